"""Mitsuba's XML as a tree of objects with named values: includes, defaults ($name), references and transforms resolved.

What nobody asks a node for remains, so that `rest` can name what was not understood.
"""

import pathlib
import re
from dataclasses import dataclass
from xml.parsers import expat

import numpy as np

from . import matrices

OBJECTS = {"bsdf", "emitter", "film", "integrator", "medium", "phase", "rfilter", "sampler", "scene", "sensor", "shape",
           "texture", "volume"}
MOST_INCLUDES = 15


class SceneError(Exception):
    """What cannot be turned, and where it stands."""

    def __init__(self, place, message):
        super().__init__(f"{place}: {message}")


@dataclass
class Element:
    """An element of an XML file."""

    tag: str
    attributes: dict
    place: str
    children: list


@dataclass
class Value:
    kind: str  # float, integer, boolean, string, rgb, spectrum, point, vector, transform
    value: object
    place: str


@dataclass
class Reference:
    id: str
    place: str


def read_elements(path):
    """The root element of a file."""
    parser = expat.ParserCreate()
    root = Element("", {}, str(path), [])
    open_elements = [root]

    def start(tag, attributes):
        element = Element(tag, attributes, f"{path}:{parser.CurrentLineNumber}", [])
        open_elements[-1].children.append(element)
        open_elements.append(element)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda tag: open_elements.pop()
    try:
        parser.Parse(path.read_bytes(), True)
    except OSError as error:
        raise SceneError(path, f"cannot be read: {error.strerror}") from None
    except (expat.ExpatError, ValueError) as error:
        raise SceneError(f"{path}:{parser.CurrentLineNumber}", f"is no XML: {error}") from None
    return root.children[0]


def numbers(text, place, counts):
    """Numbers between commas or blanks, as many as one of `counts` says."""
    words = text.replace(",", " ").split()
    try:
        values = [float(word) for word in words]
    except ValueError:
        raise SceneError(place, f"'{text}' is not made of numbers") from None
    if len(values) not in counts or not np.isfinite(values).all():
        raise SceneError(place, f"'{text}' is not {' or '.join(map(str, counts))} finite numbers")
    return values


def snake_case(name):
    """Names of scenes before version 2 are in camelCase."""
    return re.sub(r"(?<=[a-z0-9])([A-Z])", r"_\1", name).lower()


class Node:
    """An object: a shape, a material, a sensor ..."""

    def __init__(self, document, tag, kind, place, folders):
        self.document, self.tag, self.type, self.place, self.folders = document, tag, kind, place, folders
        self.id, self.values, self.children, self.used = "", {}, [], set()

    def __str__(self):
        return f"{self.tag} '{self.type}'"

    def fail(self, message, name=None):
        place = self.values[name].place if name in self.values else self.place
        raise SceneError(place, f"{self}: {message}")

    def take(self, name, kinds, default=None):
        self.used.add(name)
        if name not in self.values:
            return default
        value = self.values[name]
        if value.kind not in kinds:
            self.fail(f"{name} is a {value.kind}, not a {' or '.join(kinds)}", name)
        return value.value

    def number(self, name, default=None):
        return self.take(name, ("float", "integer"), default)

    def integer(self, name, default=None):
        return self.take(name, ("integer",), default)

    def boolean(self, name, default=False):
        return self.take(name, ("boolean",), default)

    def text(self, name, default=None):
        return self.take(name, ("string",), default)

    def point(self, name, default=None):
        return self.take(name, ("point", "vector"), default)

    def transform(self):
        return self.take("to_world", ("transform",), np.eye(4))

    def ignore(self, *names):
        """Values and objects of these names make no difference."""
        self.used.update(names)

    def objects(self, *tags):
        """Pairs of a name and an object inside, references followed."""
        found = []
        for index, (name, child) in enumerate(self.children):
            node = self.document.resolve(child)
            if node.tag in tags:
                self.used.add(index)
                found.append((name, node))
        return found

    def only(self, tag):
        """The one object of this tag inside, or none."""
        found = [node for _, node in self.objects(tag)]
        if len(found) > 1:
            raise SceneError(found[1].place, f"a second {tag} of {self}")
        return found[0] if found else None

    def file(self, name="filename"):
        text = self.text(name)
        if not text:
            self.fail(f"{name} is missing")
        for folder in self.folders:
            if (folder / text).is_file():
                return folder / text
        return self.fail(f"there is no file {text}", name)

    def rest(self):
        """What nobody asked for, as errors."""
        for name, value in self.values.items():
            if name not in self.used:
                yield SceneError(value.place, f"{self}: {name} is not understood here")
        for index, (name, child) in enumerate(self.children):
            if index not in self.used and name not in self.used:
                node = self.document.resolve(child)
                yield SceneError(child.place, f"{self}: {node} is not understood here")


class Document:
    """A file and all that it includes."""

    def __init__(self, path, definitions):
        self.parameters, self.ids, self.used_parameters = dict(definitions), {}, set()
        self.folder = pathlib.Path(path).parent
        self.root = self._read(pathlib.Path(path), 0)
        if self.root.tag != "scene":
            raise SceneError(self.root.place, f"is a {self.root.tag}, not a scene")

    def resolve(self, child):
        if isinstance(child, Node):
            return child
        if child.id not in self.ids:
            raise SceneError(child.place, f"nothing has the id '{child.id}'")
        return self.ids[child.id]

    def unused_definitions(self, definitions):
        return [name for name in definitions if name not in self.used_parameters]

    def _read(self, path, depth):
        element = read_elements(path)
        if depth > MOST_INCLUDES:
            raise SceneError(element.place, f"files include each other more than {MOST_INCLUDES} deep")
        version = element.attributes.pop("version", None)
        if version is None:
            raise SceneError(element.place, f"<{element.tag}> says no version: is this a scene of Mitsuba?")
        major = version.split(".")[0]
        if not major.isdigit():
            raise SceneError(element.place, f"'{version}' is no version")
        context = Context(self, path, [path.parent, self.folder], int(major) < 2, depth)
        return context.node(element)

    def substituted(self, text, place):
        def parameter(match):
            if match[1]:
                return match[0][1:]
            word = match[2]
            for end in range(len(word), 0, -1):
                if word[:end] in self.parameters:
                    self.used_parameters.add(word[:end])
                    return self.parameters[word[:end]] + word[end:]
            raise SceneError(place, f"${word} has no value (-D {word}=VALUE gives it one)")

        return re.sub(r"(\\?)\$(\w+)", parameter, text)


@dataclass
class Context:
    """What the elements of a file share."""

    document: Document
    path: pathlib.Path
    folders: list
    camel_case: bool
    depth: int

    def node(self, element):
        attributes = self.attributes(element)
        kind = attributes.get("type", "scene" if element.tag == "scene" else "")
        tag = "texture" if element.tag == "spectrum" else element.tag
        node = Node(self.document, tag, kind, element.place, self.folders)
        node.id = attributes.get("id", "")
        if node.id:
            if node.id in self.document.ids:
                raise SceneError(element.place, f"a second object with the id '{node.id}'")
            self.document.ids[node.id] = node
        for child in element.children:
            self.add(node, child)
        return node

    def attributes(self, element):
        return {name: self.document.substituted(text, element.place) for name, text in element.attributes.items()}

    def add(self, node, element):
        tag, place, attributes = element.tag, element.place, self.attributes(element)

        def required(name):
            if name not in attributes:
                raise SceneError(place, f"<{tag}> without {name}")
            return attributes[name]

        name = attributes.get("name", "")
        name = snake_case(name) if self.camel_case else name
        if tag in OBJECTS or tag == "spectrum" and "type" in attributes:
            node.children.append((name, self.node(element)))
        elif tag == "ref":
            node.children.append((name, Reference(required("id"), place)))
        elif tag == "default":
            self.document.parameters.setdefault(required("name"), required("value"))
            self.document.used_parameters.add(name)
        elif tag == "include":
            self.include(node, self.found(required("filename"), place))
        elif tag == "alias":
            self.document.ids[required("as")] = self.document.resolve(Reference(required("id"), place))
        elif tag == "path":
            self.folders.insert(0, self.path.parent / required("value"))
        else:
            required("name")
            node.values[name] = Value(tag, self.value(element, attributes, required), place)

    def found(self, filename, place):
        for folder in self.folders:
            if (folder / filename).is_file():
                return folder / filename
        raise SceneError(place, f"there is no file {filename}")

    def include(self, node, path):
        included = self.document._read(path, self.depth + 1)
        if included.tag == "scene":
            node.children += included.children
        else:
            node.children.append(("", included))

    def value(self, element, attributes, required):
        tag, place = element.tag, element.place
        if tag == "transform":
            return self.transform(element)
        if tag in ("point", "vector"):
            if "value" in attributes:
                return np.array(numbers(attributes["value"], place, (3,)))
            return np.array([numbers(required(axis), place, (1,))[0] for axis in "xyz"])
        if tag == "spectrum":
            return attributes.get("value", attributes.get("filename", ""))
        text = required("value").strip()
        if tag == "string":
            return text
        if tag == "float":
            return numbers(text, place, (1,))[0]
        if tag == "rgb":
            return np.broadcast_to(numbers(text, place, (1, 3)), 3)
        if tag == "integer" and re.fullmatch(r"[+-]?\d+", text):
            return int(text)
        if tag == "boolean" and text.lower() in ("true", "false"):
            return text.lower() == "true"
        if tag in ("integer", "boolean"):
            raise SceneError(place, f"'{text}' is no {tag}")
        raise SceneError(place, f"<{tag}> is not understood")

    def transform(self, element):
        result = np.eye(4)
        for step in element.children:
            result = self.step(step.tag, self.attributes(step), step.place) @ result
        return result

    def step(self, tag, attributes, place):
        def vector(otherwise):
            if "value" in attributes:
                return np.broadcast_to(numbers(attributes["value"], place, (1, 3)), 3)
            return np.array([numbers(attributes.get(axis, otherwise), place, (1,))[0] for axis in "xyz"])

        def listed(name, counts, otherwise=""):
            return np.array(numbers(attributes.get(name, otherwise), place, counts))

        try:
            if tag == "translate":
                return matrices.translation(vector("0"))
            if tag == "scale":
                return matrices.scaling(vector("1"))
            if tag == "rotate":
                return matrices.rotation(vector("0"), listed("angle", (1,))[0])
            if tag in ("lookat", "lookAt"):
                return matrices.look_at(listed("origin", (3,)), listed("target", (3,)), listed("up", (3,), "0 0 0"))
            if tag == "matrix":
                return matrices.from_numbers(listed("value", (9, 16)))
        except ValueError as error:
            raise SceneError(place, f"<{tag}> {error}") from None
        raise SceneError(place, f"<{tag}> is no step of a transform")
