"""A small reader and writer of OpenEXR files: single-part images in scanlines or tiles, NO, ZIPS or ZIP compression.

Of tiled images with several resolutions the finest is read. Follows the OpenEXR documentation ("OpenEXR File Layout"). Samples are
32-bit floats; halves and 32-bit integers are read too.
"""

from __future__ import annotations

import contextlib
import struct
import zlib
from collections.abc import Collection, Iterator, Mapping
from typing import Any, BinaryIO

import numpy as np

from isochron.errors import InputError
from isochron.files import replacing

MAGIC = 20000630
SAMPLE_TYPES = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
MOST_OF_HEADER = 1 << 24  # bytes, by far
LINES_PER_BLOCK = {0: 1, 2: 1, 3: 16}  # by compression: none, ZIPS, ZIP


class ExrError(InputError):
    """The file is no EXR, is damaged, or uses what this reader leaves out."""


def _text(data, position):
    end = data.index(b"\0", position)
    return data[position:end].decode("utf-8"), end + 1


def _header(data):
    """Attributes by name, as bytes, and the position after them."""
    if len(data) < 8 or struct.unpack_from("<I", data)[0] != MAGIC:
        raise ExrError("not an OpenEXR file")
    version = struct.unpack_from("<I", data, 4)[0]
    if version & 0x1800:
        raise ExrError("deep and multi-part files are not supported")
    attributes, position = {}, 8
    while data[position] != 0:
        name, position = _text(data, position)
        _, position = _text(data, position)
        size = struct.unpack_from("<i", data, position)[0]
        attributes[name] = data[position + 4 : position + 4 + size]
        position += 4 + size
    return attributes, position + 1


def _channels(attribute):
    """(name, sample type) of every channel, in the order in which they are stored."""
    channels, position = [], 0
    while attribute[position] != 0:
        name, position = _text(attribute, position)
        kind, _, sampling_x, sampling_y = struct.unpack_from("<iiii", attribute, position)
        if kind not in SAMPLE_TYPES or (sampling_x, sampling_y) != (1, 1):
            raise ExrError(f"channel {name}: unsupported sample type or subsampling")
        channels.append((name, SAMPLE_TYPES[kind]))
        position += 16
    return channels


def _inflate(block, size):
    """Undoes zlib, then the byte differences, then the split into even and odd bytes."""
    raw = np.frombuffer(zlib.decompress(block), dtype=np.uint8)
    if len(raw) != size:
        raise ExrError("a block of pixels has the wrong size")
    # Each byte is stored as its difference from the one before, plus 128.
    raw = np.cumsum(raw, dtype=np.uint8)
    raw[1::2] += 128
    half = (size + 1) // 2
    out = np.empty(size, dtype=np.uint8)
    out[0::2], out[1::2] = raw[:half], raw[half:]
    return out.tobytes()


def _inflate_some(block, planes, columns, wanted):
    """Of a block of so many planes (a line of a channel) of 32-bit floats the wanted ones, planes x columns: the others are not
    taken apart."""
    width = 2 * columns  # bytes of a plane among the even bytes of the block, as many among the odd ones
    rows = np.concatenate([np.asarray(wanted, dtype=int) + half * planes for half in (0, 1)])
    kept, sums = np.empty((len(rows), width), np.uint8), np.empty(2 * planes, np.uint8)
    stream = zlib.decompressobj()
    step = max(1, (1 << 19) // width)  # what stays in the cache
    for first in range(0, 2 * planes, step):
        count = min(step, 2 * planes - first)
        part = stream.decompress(block, count * width)
        block = stream.unconsumed_tail
        if len(part) != count * width:
            raise ExrError("a block of pixels has the wrong size")
        part = np.frombuffer(part, np.uint8).reshape(count, width)
        sums[first : first + count] = part.sum(axis=1, dtype=np.uint8)
        low, high = np.searchsorted(rows, (first, first + count))
        kept[low:high] = part[rows[low:high] - first]
    if stream.decompress(block, 1):
        raise ExrError("a block of pixels has the wrong size")
    before = np.cumsum(sums, dtype=np.uint8) - sums
    bytes_ = np.cumsum(kept, axis=1, dtype=np.uint8) + before[rows, None]
    bytes_[:, 1::2] += 128
    return np.stack(np.split(bytes_, 2), axis=-1).reshape(len(wanted), 2 * width).view("<f4")


def _blocks(data, position, width, height, step):
    """Of scanlines: first column and row, columns, rows, and the stored pixels of each block."""
    for start in struct.unpack_from(f"<{-(-height // step)}Q", data, position):
        y, size = struct.unpack_from("<ii", data, start)
        yield 0, y, width, step, data[start + 8 : start + 8 + size]


def _tiles(data, position, width, height, tiles):
    """The same of the tiles of the finest level, whose offsets come first."""
    across, down = struct.unpack_from("<II", tiles)
    if not across or not down:
        raise ExrError("tiles without pixels")
    count = -(-width // across) * -(-height // down)
    for start in struct.unpack_from(f"<{count}Q", data, position):
        x, y, level_x, level_y, size = struct.unpack_from("<iiiii", data, start)
        if (level_x, level_y) != (0, 0):
            raise ExrError("a tile is of another level than its place says")
        yield x * across, y * down, min(across, width - x * across), down, data[start + 20 : start + 20 + size]


def _parse(data, wanted):
    attributes, position = _header(data)
    channels = _channels(attributes["channels"])
    asked = [i for i, (name, _) in enumerate(channels) if wanted is None or name in wanted]
    alike = all(kind == SAMPLE_TYPES[2] for _, kind in channels)
    compression = attributes["compression"][0]
    if compression not in LINES_PER_BLOCK:
        raise ExrError(f"compression {compression} is not supported; allowed: none, ZIPS, ZIP")
    x0, y0, x1, y1 = struct.unpack("<iiii", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    images = {name: np.empty((height, width), dtype=kind.newbyteorder("=")) for name, kind in (channels[i] for i in asked)}
    if struct.unpack_from("<I", data, 4)[0] & 0x200:
        blocks = _tiles(data, position, width, height, attributes["tiles"])
    else:
        # Rows of scanlines are numbered by the data window, those of tiles from its first.
        blocks = ((x, y - y0, *rest) for x, y, *rest in _blocks(data, position, width, height, LINES_PER_BLOCK[compression]))
    for column, row, columns, lines, block in blocks:
        if not 0 <= row < height or not 0 <= column < width:
            raise ExrError("a block of pixels lies outside the image")
        lines = min(lines, height - row)
        size = lines * columns * sum(kind.itemsize for _, kind in channels)
        if alike and len(asked) < len(channels) and compression and len(block) < size:
            planes = [line * len(channels) + i for line in range(lines) for i in asked]
            values = _inflate_some(block, lines * len(channels), columns, planes)
            for at, (line, i) in enumerate((line, i) for line in range(lines) for i in asked):
                images[channels[i][0]][row + line, column : column + columns] = values[at]
            continue
        # A block that compression would have made larger is stored as it is.
        if compression and len(block) < size:
            block = _inflate(block, size)
        at = 0
        for line in range(lines):
            for name, kind in channels:
                if name in images:
                    images[name][row + line, column : column + columns] = np.frombuffer(block, kind, columns, at)
                at += columns * kind.itemsize
    return images


@contextlib.contextmanager
def _reading(path: Any) -> Iterator[BinaryIO]:
    """Errors of what is done with the file name it."""
    try:
        with open(path, "rb") as file:
            yield file
    except ExrError as error:
        raise ExrError(f"{path}: {error}") from None
    except (IndexError, KeyError, ValueError, struct.error, zlib.error) as error:
        raise ExrError(f"{path}: damaged file ({error})") from error


def read(path: Any, names: Collection[str] | None = None) -> dict[str, np.ndarray]:
    """All channels, or those of some names: name -> array of height x width, row 0 at the top. Raises ExrError, OSError."""
    with _reading(path) as file:
        return _parse(file.read(), names)


def attributes(path: Any) -> dict[str, bytes]:
    """The header: name -> value as bytes. Raises ExrError, OSError."""
    with _reading(path) as file:
        return _header(file.read(MOST_OF_HEADER))[0]


def channel_names(path: Any) -> list[str]:
    """In the order in which they are stored. Raises ExrError, OSError."""
    with _reading(path) as file:
        return [name for name, _ in _channels(_header(file.read(MOST_OF_HEADER))[0]["channels"])]


def write(path: Any, images: Mapping[str, Any], notes: Mapping[str, str] | None = None) -> None:
    """Writes name -> array of height x width as 32-bit floats with ZIPS compression; `notes` (name -> text) go into the
    header."""
    names = sorted(images)
    height, width = np.shape(images[names[0]])
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    channels = b"".join(n.encode() + b"\0" + struct.pack("<iiii", 2, 0, 1, 1) for n in names) + b"\0"
    attributes = [
        ("channels", "chlist", channels),
        ("compression", "compression", b"\2"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ]
    attributes += [(name, "string", text.encode()) for name, text in (notes or {}).items()]
    # Version 2; the flag allows names longer than 31 characters.
    out = bytearray(struct.pack("<II", MAGIC, 2 | (0x400 if max(map(len, names)) > 31 else 0)))
    for name, kind, value in attributes:
        out += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    out += b"\0"
    stack = np.stack([np.asarray(images[n], dtype="<f4") for n in names])
    blocks = []
    for y in range(height):
        raw = np.frombuffer(np.ascontiguousarray(stack[:, y]).tobytes(), dtype=np.uint8)
        split = np.concatenate([raw[0::2], raw[1::2]])
        split[1:] = np.diff(split) + np.uint8(128)
        packed = zlib.compress(split.tobytes())
        packed = packed if len(packed) < len(raw) else raw.tobytes()
        blocks.append(struct.pack("<ii", y, len(packed)) + packed)
    starts = len(out) + 8 * height + np.cumsum([0] + [len(b) for b in blocks[:-1]])
    out += starts.astype("<u8").tobytes() + b"".join(blocks)
    with replacing(path) as temporary:
        temporary.write_bytes(out)
