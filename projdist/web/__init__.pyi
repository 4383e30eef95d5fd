from .live.dispatcher import InputPolicy
from .live.notebook import Explorer
from .live.server import LiveSite, Start, check_server, open_socket, serve
from .page import MOST_MAPS, SHOWN_MEASURES, Cell, Maps, Page, PageTable, cell_step, draw_maps, page_html

__all__ = [
    "MOST_MAPS",
    "SHOWN_MEASURES",
    "Cell",
    "Explorer",
    "InputPolicy",
    "LiveSite",
    "Maps",
    "Page",
    "PageTable",
    "Start",
    "cell_step",
    "check_server",
    "draw_maps",
    "open_socket",
    "page_html",
    "serve",
]
