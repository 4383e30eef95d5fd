// Maps as points by their errors of angles and areas; a click opens one.

const SPACE = "http://www.w3.org/2000/svg";
const [WIDTH, HEIGHT, LEFT, LOW, EDGE, TOP] = [420, 356, 58, 44, 14, 30];
const KINDS = { own: ["a map of this page", 6], other: ["one of the best CRSs", 4.5] };

function drawn(name, attributes, children = []) {
  const node = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  node.append(...children);
  return node;
}

// Round numbers from 0 to about a largest value.
function ticks(largest) {
  const power = 10 ** Math.floor(Math.log10(largest / 4)), step = [1, 2, 5, 10].find((m) => m * power >= largest / 5) * power;
  return Array.from({ length: Math.floor(largest / step + 1e-9) + 1 }, (_, k) => Number((k * step).toPrecision(12)));
}

// What the colours and sizes of the points mean, above the plot.
function legend() {
  return Object.entries(KINDS).flatMap(([kind, [text, r]], k) => {
    const x = LEFT + 8 + k * 150;
    return [drawn("circle", { cx: x, cy: 14, r, class: `${kind} key` }), drawn("text", { x: x + 12, y: 18 }, [text])];
  });
}

export function scatter(points) {
  const largest = Math.max(1e-9, ...points.flatMap(({ x, y }) => [x, y])) * 1.06;
  const across = (value) => LEFT + (value / largest) * (WIDTH - LEFT - EDGE);
  const up = (value) => HEIGHT - LOW - (value / largest) * (HEIGHT - LOW - TOP);
  const node = drawn("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "group", "aria-label": "Errors of areas against errors of angles" });
  for (const tick of ticks(largest)) {
    const [x, y] = [across(tick), up(tick)];
    node.append(
      drawn("line", { x1: x, x2: x, y1: up(0), y2: TOP, class: "rule" }),
      drawn("line", { x1: LEFT, x2: WIDTH - EDGE, y1: y, y2: y, class: "rule" }),
      drawn("text", { x, y: up(0) + 16, "text-anchor": "middle" }, [String(tick)]),
      drawn("text", { x: LEFT - 6, y: y + 4, "text-anchor": "end" }, [String(tick)]),
    );
  }
  node.append(
    drawn("text", { x: across(largest / 2), y: HEIGHT - 8, "text-anchor": "middle" }, ["angular error, RMS of ln(a/b) / √2"]),
    drawn("text", { transform: `translate(13 ${up(largest / 2)}) rotate(-90)`, "text-anchor": "middle" }, ["areal error, RMS of ln(ab) / √2"]),
  );
  node.append(...legend());
  for (const { name, x, y, work, kind } of points) {
    const label = `${name}: angles ${x.toPrecision(3)}, areas ${y.toPrecision(3)}, ${KINDS[kind][0]}`;
    const point = drawn("circle", { cx: across(x), cy: up(y), r: KINDS[kind][1], class: kind, tabindex: 0, role: "button", "aria-label": label }, [
      drawn("title", {}, [label]),
    ]);
    point.addEventListener("click", work);
    point.addEventListener("keydown", (event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      work();
    });
    node.append(point);
  }
  return node;
}
