"""`Explorer`, or without anywidget a stand-in that raises ImportError."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from projdist.web.live.widget import Explorer as Explorer
else:
    try:
        from projdist.web.live.widget import Explorer
    except ModuleNotFoundError as missing:
        if missing.name not in ("anywidget", "ipywidgets", "traitlets"):
            raise
        _missing = missing.name

        class Explorer:
            """Interactive maps in a notebook; needs anywidget."""

            def __init__(self, *projections: Any, **options: Any) -> None:
                text = "The explorer in notebooks needs anywidget: pip install 'projdist[explore]'."
                raise ImportError(text, name=_missing)
