"""The command `clouds`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import typer

from projdist._typing import FloatArray
from projdist.applications import pointclouds
from projdist.cli import options as opt
from projdist.cli.errors import fail, refuse, refusing
from projdist.cli.formats import drawing, present
from projdist.cli.report import Column, Columns, Report, Table
from projdist.support import refuse_existing

_FARTHEST = 3  # points that are named


def clouds_command(
    files: list[str] = opt.argument("FILE...", "Two clouds or more: .csv, of any dimension, .xyz, .asc, .ply or .pcd."),
    frame: str = opt.option(
        "mdt|best|first|last|central|FILE|INDEX",
        "Frame to bring all to: the mean distorting transformation (MDT) of all, or the coordinates of one "
        "cloud: the one that distorts the others least, the first, the last, the middle one, or by its name or "
        "number, from 1.",
        "mdt",
    ),
    correspond: str | None = opt.option(
        pointclouds.CORRESPONDENCES,
        "Which points are the same: those in equal rows, with equal ids, or, where nobody knows, the closest "
        "ones of clouds that lie nearly right. If not given: id where all files have a column id, else rows.",
    ),
    method: str = opt.option(
        pointclouds.FITS, "Fit that prefers no cloud and shrinks none, or least squares onto the first.", "symmetric"
    ),
    robust: bool = opt.flag("--robust", "Leave out points that are no partners of those with their row or id."),
    weights: str | None = opt.option(
        "COLUMN|FILE",
        "What each point counts: a column of the clouds' files, or a file with a number for each row, or id "
        "and number. 2 is as two points, 0 as none. In a cloud without the column points count as their partners.",
    ),
    format: opt.Format = "table",
    output: str | None = opt.output("Directory for the moved clouds, each as its file.", metavar="DIR"),
    overwrite: opt.Overwrite = False,
) -> None:
    """Register point clouds or landmarks by affine maps, in the frame that distorts them least."""
    form = opt.format_of(format)
    opt.choice("method", method, pointclouds.FITS)
    if correspond is not None:
        opt.choice("correspondence", correspond, pointclouds.CORRESPONDENCES)
    targets = _targets(files, output, overwrite)
    with refusing():
        numbers, column = None, weights
        if weights is not None:
            path = Path(weights)
            if path.is_file():
                numbers, column = pointclouds.read_weights(weights), None
            elif path.suffix or len(path.parts) > 1:
                refuse(f"Invalid weights '{weights}'. There is no such file.")
        clouds = [pointclouds.read_cloud(file, weights=column) for file in files]
        ids = [cloud.ids for cloud in clouds if cloud.ids is not None]
        if correspond is None:
            correspond = "id" if len(ids) == len(clouds) else "rows"
        if correspond == "id" and len(ids) < len(clouds):
            without = next(cloud.path for cloud in clouds if cloud.ids is None)
            refuse(f"Invalid cloud '{without}'. For the correspondence id it must be a .csv with a column id.")
        found = pointclouds.register(
            [cloud.points for cloud in clouds],
            correspond=correspond,
            ids=ids if correspond == "id" else None,
            frame=_frame(frame, files),
            method=method,
            names=files,
            robust=robust,
            weights=None if weights is None else _weights(clouds, numbers or weights, correspond),
        )
    if output is not None:
        folder, by_name = Path(output), {str(target): cloud for target, cloud in zip(targets, clouds, strict=True)}
        with drawing(folder):
            folder.mkdir(exist_ok=True)
            for name, M, t in zip(found.names, found.matrices, found.shifts, strict=True):
                by_name[name].write(targets[name], M, t, overwrite=overwrite)
    present(_report(found, output), form)
    for one in found.left_out:
        fail(f"Left out '{one.name}': {one.reason}.")
    for warning in found.warnings:
        fail(warning)
    if found.left_out:
        raise typer.Exit(1)


def _weights(
    clouds: Sequence[pointclouds.CloudFile], given: pointclouds.WeightsFile | str, correspond: str
) -> list[FloatArray]:
    """Weights of each cloud, from the file or from a column."""
    if isinstance(given, str):
        return pointclouds.column_weights(clouds, given, correspond)
    if correspond == "icp":
        refuse(f"Invalid weights '{given.path}'. With the correspondence icp they must be a column of clouds.")
    return [given.numbers if correspond == "rows" else given.of_ids(cloud) for cloud in clouds]


def _frame(text: str, files: Sequence[str]) -> str | int:
    """Frame from a keyword, a file's name (with or without directory) or its number from 1."""
    if text.isdecimal():
        if not 1 <= int(text) <= len(files):
            refuse(f"Invalid frame '{text}'. There are {len(files)} clouds, from 1 on.")
        return int(text) - 1
    same = [file for file in files if Path(file).name == text]
    return same[0] if len(same) == 1 and text not in files else text


def _targets(files: Sequence[str], output: str | None, overwrite: bool) -> dict[str, Path]:
    """Output path of each cloud; refuses existing files without `overwrite`."""
    for file in files:
        if files.count(file) > 1:
            refuse(f"Invalid cloud '{file}'. It must be given once.")
    if output is None:
        return {}
    folder = Path(output)
    if folder.exists() and not folder.is_dir():
        refuse(f"Invalid output '{output}'. It must be a directory.")
    if not folder.parent.is_dir():
        refuse(f"Invalid output '{output}'. There is no directory '{folder.parent}'.")
    targets = {file: folder / Path(file).name for file in files}
    for file, target in targets.items():
        if list(targets.values()).count(target) > 1:
            refuse(f"Invalid cloud '{file}'. Another has its name, and '{output}' has room for one.")
        if target.exists() and target.samefile(file):
            refuse(f"Invalid output '{output}'. It holds the clouds themselves.")
        if not overwrite:
            with refusing():
                refuse_existing(target)
    return targets


def _report(found: pointclouds.Registration, output: str | None) -> Report:
    answer = found.to_dict()
    rows = [{name: value for name, value in row.items() if name not in ("matrix", "shift")} for row in answer["clouds"]]
    clouds = [
        Column("name", "cloud", left=True),
        Column("used", "points", of=lambda row: f"{row['used']} of {row['points']}"),
        Column("distortion", "Dist_F", "{:.6f}".format),
        Column("sum_as_frame", "as frame", "{:.6g}".format),
        Column("rms", show="{:.4g}".format),
    ]
    frames: Columns = [
        "frame",
        Column("cloud", "is", of=lambda row: row["cloud"] or "the mean of all", left=True),
        Column("sum", "sum of Dist_F^2", "{:.6g}".format),
    ]
    notes = [
        "Dist_F: distortion of a cloud's matrix, 0 for a rotation; as frame: the sum of Dist_F^2 if all were "
        "brought to that cloud; rms: distance from the points' mean places in the frame. Matrices: --format json."
    ]
    far = sorted((one for each in found.worst for one in each), key=lambda one: -one.distance)[:_FARTHEST]
    if far:
        told = ", ".join(f"{one.point} of {Path(one.cloud).name} {one.distance:.3g}" for one in far)
        notes.append(f"Farthest from where the others have them, by the fit without them: {told}.")
    weighted = ", by weights" if answer["weighted"] else ""
    return Report(
        title=f"{len(rows)} clouds in {answer['dimension']} dimensions, by {found.correspond} ({found.method}), in the "
        f"frame {answer['reference'] or found.frame}{weighted}: rms {found.rms_total:.4g}",
        tables=[
            Table(rows, clouds),
            Table([{"frame": name} | figures for name, figures in answer["frames"].items()], frames),
        ],
        notes=[*notes, f"Modes, in which the clouds differ: {found.modes.summary}."],
        data=lambda: answer,
        rows=lambda: rows,
        written=[Path(output) if output else None],
    )
