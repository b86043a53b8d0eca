"""Live relighting of a mesh in a web browser: one HTML file, or a widget in a notebook.

Transfer is sent once, as 16-bit integers; the graphics processor shades each vertex from it
whenever the light changes. The pages are plain WebGL2 and need neither a network nor a server.
"""

from ._html import export_html
from ._lamp import Lamp
from ._sky import Sky
from ._widget import view

__all__ = ["Lamp", "Sky", "export_html", "view"]
