"""isochron: inverse rendering for time-of-flight cameras."""
