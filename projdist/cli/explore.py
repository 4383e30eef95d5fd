"""The command `explore`."""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import webbrowser

from projdist import web
from projdist.cli import options as opt
from projdist.cli.errors import refuse, refusing
from projdist.cli.formats import emit
from projdist.matrices import get_measure
from projdist.projections import Projection
from projdist.regions import region_for
from projdist.support import check_choice

_FIRST = "winkel-tripel"
_MOST = 6
_LAST_PORT = 65535


def explore_command(
    projections: list[str] | None = opt.argument("[PROJECTION...]", "As for compare; Winkel's if there is none.", None),
    region: opt.Region = None,
    measure: str = opt.option(
        "NAME", "The measure shown first (see 'projdist list measures').", "fisher", *opt.MEASURE
    ),
    port: str | None = opt.option("NUMBER", "Of the address; any free one if not given."),
    no_browser: bool = opt.flag("--no-browser", "Print the address and open no browser."),
) -> None:
    """See maps live in a browser: drag them, turn their parameters, point at them, ask for better ones."""
    given = projections or [_FIRST]
    if len(given) > _MOST:
        refuse(f"Invalid projections. A page has at most {_MOST}, and {len(given)} were given.")
    with refusing():
        maps = [Projection.from_user_input(text) for text in given]
        chosen = get_measure(measure).name
        check_choice("measure", chosen, web.SHOWN_MEASURES)
        place = region_for(opt.region_given(region, given), maps)
        web.check_server()
        wanted = 0 if port is None else opt.whole_number("port", port, 0, _LAST_PORT)
    try:
        listening = web.open_socket(wanted)
    except OSError as error:
        refuse(f"Invalid port '{port}'. It cannot be listened on: {os.strerror(error.errno or 0)}.", error)
    text = region or place.name
    start = web.Start(projections=tuple(given), region=text, measure=chosen)
    with contextlib.closing(web.LiveSite(start, web.InputPolicy(frozenset([*given, text])))) as site:
        address = site.url(listening.getsockname()[1])
        emit(f"{address}\n", None)
        sys.stdout.flush()
        if not no_browser:  # one in the terminal does not return before it is closed
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()
        web.serve(site, listening)
