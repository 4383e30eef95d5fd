from .live.dispatcher import Doors
from .live.notebook import Explorer
from .live.server import Site, Start, check_server, open_socket, serve
from .page import MOST_MAPS, SHOWN_MEASURES, Cell, Maps, Page, PageTable, draw_maps, page_html

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
