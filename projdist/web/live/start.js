// The page of `projdist explore`: its socket, and the view that its address tells.

import { Explorer } from "./explore.js";
import { Socket } from "./link.js";

const root = document.getElementById("explore");
const given = new URLSearchParams(location.hash.slice(1));
const token = given.get("token") ?? "";
let explorer = null;

const socket = new Socket(`ws://${location.host}/socket`, token, (state, welcome) => {
  if (state === "refused" && explorer) explorer.refused();
  if (state === "refused" && !explorer) {
    root.textContent = "This address lacks the right token. Use the one that the command printed.";
  }
  if (state === "full" && !explorer) root.textContent = "Too many pages are open. This one continues when another is closed.";
  if (state === "full" || state === "closed") explorer?.lost();
  if (state !== "open") return;
  if (explorer) explorer.found();
  else explorer = new Explorer(root, socket, { ...welcome, ...stated() }, remember);
});

// What the fragment of the address says of the view.
function stated() {
  const view = {}, maps = given.getAll("map");
  if (maps.length) view.projections = maps;
  for (const name of ["region", "measure"]) if (given.get(name)) view[name] = given.get(name);
  for (const name of ["ellipses", "isolines"]) if (given.has(name)) view[name] = given.get(name) === "1";
  const spacing = Number(given.get("spacing"));
  if (spacing >= 24 && spacing <= 120) view.spacing = spacing;
  return view;
}

function remember({ projections, region, measure, ellipses, isolines, spacing }) {
  const view = new URLSearchParams({
    token, region, measure, ellipses: Number(ellipses), isolines: Number(isolines), spacing,
  });
  for (const projection of projections) view.append("map", projection);
  history.replaceState(null, "", `#${view}`);
}

// Another view, typed or pasted over this one.
addEventListener("hashchange", () => location.reload());
