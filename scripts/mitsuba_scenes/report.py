"""What is said of a scene: what cannot be turned, and what becomes of it."""

import re

from .document import SceneError


class Report:
    def __init__(self):
        self.refused, self.notes = [], []

    def note(self, place, text):
        line = f"{place}: {text}"
        if line not in self.notes:
            self.notes.append(line)

    def refuse(self, error):
        if str(error) not in self.refused:
            self.refused.append(str(error))

    def attempt(self, function, *arguments, otherwise=None):
        """The function's result or, where it cannot turn something, what stands in for it."""
        try:
            return function(*arguments)
        except SceneError as error:
            self.refuse(error)
            return otherwise

    def refuse_rest(self, node):
        for error in node.rest():
            self.refuse(error)

    @staticmethod
    def by_line(lines):
        """In the order of the file."""
        return sorted(lines, key=lambda line: [int(n) if n.isdigit() else n for n in re.split(r":(\d+): ", line, 1)])
