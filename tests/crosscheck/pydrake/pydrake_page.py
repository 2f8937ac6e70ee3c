"""What pydrake's Meshcat has drawn, read from its static page."""

import base64
import re

import numpy as np


def drawn(meshcat):
    """Returns path -> {"object", "pose", "properties"} of everything below /drake."""
    import msgspec

    found = {}
    for text in re.findall(r"base64,([A-Za-z0-9+/=]+)", meshcat.StaticHtml()):
        try:
            command = msgspec.msgpack.decode(base64.b64decode(text))
        except (msgspec.MsgspecError, ValueError):
            continue
        if not isinstance(command, dict) or not str(command.get("path", "")).startswith("/drake"):
            continue
        element = found.setdefault(command["path"], {"object": None, "pose": None, "properties": {}})
        if command["type"] == "set_object":
            element["object"] = command["object"]
        elif command["type"] == "set_transform":
            element["pose"] = np.array(command["matrix"]).reshape(4, 4).T
        elif command["type"] == "set_property":
            element["properties"][command["property"]] = command["value"]
    return found
