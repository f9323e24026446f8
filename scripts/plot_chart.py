#!/usr/bin/python3
"""isochron.plot_chart of app/python, to be run from a checkout: --help shows its use."""

import sys

import use_package
from isochron.plot_chart import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
