"""Mitsuba's XML as a tree of objects with named values: includes, defaults ($name), references and transforms resolved.

What nobody asks a node for remains, so that `rest` can name what was not understood.
"""

import pathlib
import re
from dataclasses import dataclass
from xml.parsers import expat

import numpy as np

from . import values
from .values import SceneError, Value

OBJECTS = {"bsdf", "emitter", "film", "integrator", "medium", "phase", "rfilter", "sampler", "scene", "sensor", "shape",
           "subsurface", "texture", "volume"}
STRUCTURE = {"ref", "default", "include", "alias", "path"}
MOST_INCLUDES = 15


@dataclass
class Element:
    """An element of an XML file."""

    tag: str
    attributes: dict
    place: str
    children: list


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


def snake_case(name):
    """Names of scenes before version 2 are in camelCase."""
    return re.sub(r"(?<=[a-z0-9])([A-Z])", r"_\1", name).lower()


class Node:
    """An object: a shape, a material, a sensor ..."""

    def __init__(self, context, tag, kind, place):
        self.context, self.document, self.tag, self.type, self.place = context, context.document, tag, kind, place
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
        if isinstance(value.value, SceneError):
            raise value.value
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
            if node is not None and node.tag in tags:
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
        return self.context.found(text, self.values[name].place, f"{self}: ")

    def rest(self):
        """What nobody asked for, as errors."""
        for name, value in self.values.items():
            if name not in self.used:
                yield value.value if isinstance(value.value, SceneError) else SceneError(value.place, f"{self}: {name} is not understood here")
        for index, (name, child) in enumerate(self.children):
            if index not in self.used and name not in self.used:
                node = self.document.resolve(child)
                if node is not None:
                    yield SceneError(child.place, f"{self}: {node} is not understood here")


class Document:
    """A file and all that it includes."""

    def __init__(self, path, definitions):
        self.parameters, self.ids, self.used_parameters = dict(definitions), {}, set()
        self.folders = [pathlib.Path(path).parent]  # where files are looked for; those of <path> come first
        self.missing = []  # what the scene refers to and is not there, as errors
        self.root = self._read(pathlib.Path(path), 0)
        if self.root.tag != "scene":
            raise SceneError(self.root.place, f"is a {self.root.tag}, not a scene")

    def resolve(self, child):
        """The object, or none where nothing has its id."""
        if isinstance(child, Node):
            return child
        if child.id not in self.ids:
            self.missing.append(SceneError(child.place, f"nothing has the id '{child.id}'"))
        return self.ids.get(child.id)

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
        context = Context(self, path, int(major) < 2, depth)
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
    old: bool  # of before version 2: names in camelCase, three numbers or one as a spectrum are RGB
    depth: int

    def node(self, element):
        attributes = self.attributes(element)
        kind = attributes.get("type", "scene" if element.tag == "scene" else "")
        tag = "texture" if element.tag == "spectrum" else element.tag
        node = Node(self, tag, kind.lower() if tag == "shape" else kind, element.place)
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
        tag, place = element.tag, element.place
        is_object = tag in OBJECTS or tag == "spectrum" and "type" in element.attributes
        if not is_object and tag not in STRUCTURE:
            name = self.name(values.required(element.attributes, "name", tag, place))
            try:
                node.values[name] = self.value(element)
            except SceneError as error:  # for who asks for it
                node.values[name] = Value(tag, error, place)
            return
        attributes = self.attributes(element)

        def needed(name):
            return values.required(attributes, name, tag, place)

        name = self.name(attributes.get("name", ""))
        if is_object:
            node.children.append((name, self.node(element)))
        elif tag == "ref":
            node.children.append((name, Reference(needed("id"), place)))
        elif tag == "default":
            self.document.parameters.setdefault(needed("name"), needed("value"))
            self.document.used_parameters.add(name)
        elif tag == "include":
            self.include(node, needed("filename"), place)
        elif tag == "alias":
            original = self.document.resolve(Reference(needed("id"), place))
            if original is not None:
                self.document.ids[needed("as")] = original
        elif tag == "path":
            self.document.folders.insert(0, self.path.parent / needed("value"))

    def name(self, text):
        return snake_case(text) if self.old else text

    def value(self, element):
        if element.tag == "transform":
            return Value(element.tag, self.transform(element), element.place)
        attributes = self.attributes(element)
        return Value(*values.value_of(element.tag, attributes, element.place), element.place)

    def transform(self, element):
        result = np.eye(4)
        for step in element.children:
            result = values.step(step.tag, self.attributes(step), step.place) @ result
        return result

    def found(self, filename, place, whose=""):
        folders = self.document.folders
        for folder in [*folders[:-1], self.path.parent, folders[-1], pathlib.Path()]:
            if (folder / filename).is_file():
                return folder / filename
        raise SceneError(place, f"{whose}there is no file {filename}")

    def include(self, node, filename, place):
        try:
            path = self.found(filename, place)
        except SceneError as error:
            self.document.missing.append(error)
            return
        included = self.document._read(path, self.depth + 1)
        if included.tag == "scene":
            node.children += included.children
        else:
            node.children.append(("", included))
