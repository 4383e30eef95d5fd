// A report: what its tables and texts do, last of all.

import { makeCopier, makeSortable } from "./tables.js";

document.querySelectorAll("table").forEach(makeSortable);
document.querySelectorAll("button.copier").forEach(makeCopier);
document.documentElement.dataset.ready = "yes";
