// The timeline of an episode: phases, literals, force and opening over time, what happens, and where the player is; drawn as SVG.
// Texts are only ever set as textContent.
"use strict";
globalThis.manitwinTimeline = (place, told, seek) => {
  const SVG = "http://www.w3.org/2000/svg";
  const BAND = 18, CHART = 74, MARKS = 14, GAP = 4;
  const times = told.time_s;
  const end = times[times.length - 1];
  const literals = told.literals.length > 1 ? told.literals : [];
  const height = BAND + (literals.length ? BAND : 0) + GAP + CHART + MARKS;
  const svg = document.createElementNS(SVG, "svg");
  svg.setAttribute("height", height);
  svg.setAttribute("role", "img");
  svg.setAttribute("aria-label", "force and opening over time; the numbers at the chosen time are below");
  place.append(svg);
  let width = 0;
  let head;
  const across = (time) => (end ? (time / end) * width : 0);
  function shape(name, kind, attributes, parent = svg) {
    const made = document.createElementNS(SVG, name);
    if (kind) made.setAttribute("class", kind);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    parent.append(made);
    return made;
  }
  function titled(made, text) {
    shape("title", "", {}, made).textContent = text;
    return made;
  }
  // a row of spans with their names, where there is room for them
  function band(spans, top) {
    spans.forEach((span, number) => {
      const from = across(span.from_s);
      const wide = Math.max(1, across(Math.min(end, span.to_s + 1 / told.rate_hz)) - from);
      titled(shape("rect", `band b${number % 2}`, { x: from, y: top, width: wide, height: BAND - 2 }), span.label);
      if (wide > 7 * span.label.length + 6) {
        shape("text", "name", { x: from + 4, y: top + BAND - 6 }).textContent = span.label;
      }
    });
  }
  function curve(values, most, top, kind, least = 0) {
    if (!(most > least)) return;
    const points = values.map((value, at) => `${across(times[at]).toFixed(1)},${(top + CHART * (1 - (value - least) / (most - least))).toFixed(1)}`);
    shape("polyline", `curve ${kind}`, { points: points.join(" ") });
  }
  function drawAll() {
    width = place.clientWidth;
    if (!width) return;
    svg.replaceChildren();
    svg.setAttribute("width", width);
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    band(told.phases, 0);
    band(literals, BAND);
    const top = height - MARKS - CHART;
    shape("rect", "frame", { x: 0.5, y: top, width: Math.max(1, width - 1), height: CHART });
    const force = Math.max(...told.forces_n.flat());
    const opened = told.hands.flatMap((each) => each.values);
    const open = Math.max(...opened);
    for (const each of told.hands) curve(each.values, open, top, "hand", each.is_opening ? 0 : Math.min(...opened));
    told.forces_n.forEach((side, number) => curve(side, force, top, `force${number}`));
    if (force > 0) shape("text", "most force", { x: 4, y: top + 11 }).textContent = `${force.toFixed(1)} N`;
    if (open > 0 && told.hands[0].is_opening) {
      shape("text", "most hand", { x: width - 4, y: top + 11, "text-anchor": "end" }).textContent = `${(1000 * open).toFixed(0)} mm`;
    }
    for (const each of told.happenings) {
      const x = Math.min(Math.max(across(each.time_s), 5), Math.max(5, width - 5));
      titled(shape("path", `mark ${each.kind === "contact" ? "bad" : ""}`, { d: `M${x} ${height - MARKS + 2}l5 10h-10z` }), `${each.time_s.toFixed(2)} s: ${each.label}`);
    }
    head = shape("line", "head", { x1: 0, x2: 0, y1: 0, y2: height });
    show(now);
  }
  let now = 0;
  function show(at) {
    now = at;
    if (!head) return;
    const x = Math.min(Math.max(across(times[at]), 1), width - 1);
    head.setAttribute("x1", x);
    head.setAttribute("x2", x);
  }
  const timeAt = (event) => ((event.clientX - svg.getBoundingClientRect().left) / Math.max(1, width)) * end;
  svg.addEventListener("pointerdown", (event) => {
    svg.setPointerCapture(event.pointerId);
    seek(timeAt(event));
  });
  svg.addEventListener("pointermove", (event) => event.buttons & 1 && seek(timeAt(event)));
  new ResizeObserver(() => place.clientWidth !== width && drawAll()).observe(place);
  drawAll();
  const key = document.createElement("p");
  key.className = "legend";
  const entries = [...told.sides.map((words, number) => [`force${number}`, words]), ["hand", told.hands.map((each) => each.name).join(", ")]];
  for (const [kind, words] of entries) {
    const dot = document.createElement("i");
    dot.className = kind;
    const span = document.createElement("span");
    span.append(dot, ` ${words}`);
    key.append(span);
  }
  place.append(key);
  return { show };
};
