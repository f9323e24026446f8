"""What commands in Python have in common."""

import argparse


class Parser(argparse.ArgumentParser):
    """Ends with one line and status 2 where arguments are wrong; with the usage, if one is given."""

    def error(self, message):
        usage = f"; usage: {self.usage}" if self.usage else ""
        self.exit(2, f"{self.prog}: {message}{usage}\n")
