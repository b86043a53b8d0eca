"""The page's own files, and its ES modules as one."""

import functools
import re
from importlib.resources import files

# Each after those that it imports from.
_MODULES = (
    *(
        "harmonics",
        "vectors",
        "clusters",
        "scene",
        "pictures",
        "sides",
        "gl",
        "controls",
        "surface",
        "renderer",
    ),
    *("sky", "near", "factors", "near_shading", "python_text"),
    *("handle", "lamp_handle", "sun_handle", "light_parts", "glossy", "glossy_part", "parts"),
    *("ball", "pointer", "view", "save"),
    *("ramp", "color_bar", "picking", "overlay", "panel", "false_color"),
    *("lobe", "viewer"),
)
_IMPORT = re.compile(r"^import\s[^;]*?from\s+\"(\./\w+)\.js\";\n", re.MULTILINE)


@functools.cache
def text(name: str) -> str:
    """Read a file of the folder `js`."""
    return files("jaxsh.viewer").joinpath("js", name).read_text("utf-8")


def styles() -> str:
    """Join the style sheets."""
    return text("style.css") + text("lights.css")


@functools.cache
def script(last: str) -> str:
    """Join the modules, and `last` behind them, into one that imports and exports nothing.

    All their names then stand beside each other: no two modules may use one for two things.
    """
    parts = [_IMPORT.sub("", text(f"{name}.js")) for name in (*_MODULES, last)]
    return "\n".join(re.sub(r"^export (?!default)", "", part, flags=re.MULTILINE) for part in parts)
