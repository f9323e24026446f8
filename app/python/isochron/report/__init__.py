"""Pages about runs: one self-contained HTML file, readable without network, for one run or for the comparison of several."""
