"""Several runs on one page."""


def comparison_page(runs):
    raise NotImplementedError
