"""Reads OpenEXR files with the Python package OpenEXR and prints what it found as JSON.

python read_exr.py FILE... -> one line per file: its header, and of each channel its type, its
size, its first pixel and a checksum of its values.
"""

import json
import sys
import zlib

import numpy
import OpenEXR


def plain(value):
    """A value of a header as JSON has it."""
    if isinstance(value, numpy.ndarray | tuple | list):
        return [plain(v) for v in value]
    if isinstance(value, numpy.generic):
        return value.item()
    return value if isinstance(value, int | float | str) else str(value)


for path in sys.argv[1:]:
    with OpenEXR.File(path, separate_channels=True) as file:
        channels = {
            name: {
                "type": str(channel.type()),
                "size": list(reversed(channel.pixels.shape)),
                "first": float(channel.pixels.flat[0]),
                "mean": float(channel.pixels.astype(numpy.float64).mean()),
                "checksum": zlib.crc32(numpy.ascontiguousarray(channel.pixels).tobytes()),
            }
            for name, channel in file.channels().items()
        }
        header = {name: plain(value) for name, value in file.header().items()}
        print(json.dumps({"header": header, "channels": channels}))
