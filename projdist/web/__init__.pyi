from .maps import MOST_MAPS, Maps, draw_maps
from .page import Cell, Page, PageTable, page_html

__all__ = ["MOST_MAPS", "Cell", "Maps", "Page", "PageTable", "draw_maps", "page_html"]
