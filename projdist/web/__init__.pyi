from .live.inputs import Doors
from .live.notebook import Explorer
from .live.server import Site, Start, check_server, open_socket, serve
from .maps import MOST_MAPS, Maps, draw_maps
from .menu import SHOWN_MEASURES
from .page import Cell, Page, PageTable, page_html

__all__ = [
    "MOST_MAPS",
    "SHOWN_MEASURES",
    "Cell",
    "Doors",
    "Explorer",
    "Maps",
    "Page",
    "PageTable",
    "Site",
    "Start",
    "check_server",
    "draw_maps",
    "open_socket",
    "page_html",
    "serve",
]
