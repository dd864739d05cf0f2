// Drawing the outline of a thing in its photo and saying what it is: by mouse, pen or finger, every tool and field also by a key.
"use strict";
(() => {
  const form = document.getElementById("outline");
  if (!form) return;
  const { page, photo: photoAddress, mask: maskAddress, next } = form.dataset;
  const canvas = document.getElementById("canvas");
  const size = document.getElementById("size");
  const said = document.getElementById("said");
  const fields = { name: document.getElementById("name"), longest_side_cm: document.getElementById("longest_side_cm") };
  const known = document.getElementById("known");
  const shown = canvas.getContext("2d");
  const photo = new Image();
  const mask = document.createElement("canvas"); // opaque where the thing is, transparent elsewhere
  const tint = document.createElement("canvas");
  const AWAY = "rgba(200, 0, 200, 0.7)";
  const MOST_UNDONE = 30;
  const NEAR_PX = 8; // of the screen: a click so near the first corner closes
  const undone = [];
  let corners = [];
  let pointer = null; // where the mouse is, in pixels of the photo
  let stroke = null; // the last place of a brush that is down
  let zoom = 1;
  let bare = false;
  let changed = false;
  let retyped = false; // a field
  let busy = false;
  let first = null; // the mask as it came

  function say(text, wrong) {
    said.textContent = text;
    said.classList.toggle("error", Boolean(wrong));
  }
  function chosen(name) {
    return form.querySelector(`input[name=${name}]:checked`).value;
  }
  function choose(name, value) {
    form.querySelector(`input[name=${name}][value=${value}]`).checked = true;
    corners = name === "tool" ? [] : corners;
    draw();
  }
  function copyOf(source) {
    const copy = document.createElement("canvas");
    copy.width = source.width;
    copy.height = source.height;
    copy.getContext("2d").drawImage(source, 0, 0);
    return copy;
  }
  function put(source) {
    const context = mask.getContext("2d");
    context.globalCompositeOperation = "copy";
    context.drawImage(source, 0, 0);
    context.globalCompositeOperation = "source-over";
  }
  function remember() {
    undone.push(copyOf(mask));
    if (undone.length > MOST_UNDONE) undone.shift();
    changed = true;
  }

  // ---- what is seen
  function screenScale() {
    return canvas.width / canvas.getBoundingClientRect().width;
  }
  function draw() {
    shown.drawImage(photo, 0, 0);
    if (bare) return;
    const over = tint.getContext("2d");
    over.globalCompositeOperation = "copy";
    over.fillStyle = AWAY;
    over.fillRect(0, 0, tint.width, tint.height);
    over.globalCompositeOperation = "destination-out";
    over.drawImage(mask, 0, 0);
    shown.drawImage(tint, 0, 0);
    const scale = screenScale();
    for (const [color, width] of [["#000", 3], ["#fff", 1.5]]) {
      shown.strokeStyle = color;
      shown.lineWidth = width * scale;
      shown.beginPath();
      if (corners.length) {
        shown.moveTo(...corners[0]);
        for (const corner of corners.slice(1)) shown.lineTo(...corner);
        if (pointer) shown.lineTo(...pointer);
      } else if (chosen("tool") === "brush" && pointer) shown.arc(...pointer, Number(size.value) / 2, 0, 2 * Math.PI);
      shown.stroke();
    }
    for (const corner of corners) {
      shown.fillStyle = "#fff";
      shown.fillRect(corner[0] - 2 * scale, corner[1] - 2 * scale, 4 * scale, 4 * scale);
    }
  }
  function enlarge(factor) {
    zoom = Math.max(1, Math.min(8, zoom * factor));
    const whole = Math.min(canvas.parentElement.clientWidth, 0.85 * innerHeight * (canvas.width / canvas.height));
    canvas.style.width = `${whole * zoom}px`;
    draw();
  }

  // ---- drawing
  function painting() {
    const context = mask.getContext("2d");
    context.globalCompositeOperation = chosen("way") === "add" ? "source-over" : "destination-out";
    context.fillStyle = context.strokeStyle = "#fff";
    return context;
  }
  function close() {
    if (corners.length < 3) {
      say("an outline has three corners or more", true);
      return;
    }
    remember();
    const context = painting();
    context.beginPath();
    for (const corner of corners) context.lineTo(...corner);
    context.closePath();
    context.fill();
    corners = [];
    say("Fit moves the outline onto edges of the photo near it.");
    draw();
  }
  function paint(to) {
    const context = painting();
    context.lineCap = "round";
    context.lineWidth = Number(size.value);
    context.beginPath();
    context.moveTo(...stroke);
    context.lineTo(to[0] + 0.01, to[1]); // a mere touch paints a spot
    context.stroke();
    stroke = to;
  }
  function placeOf(event) {
    const box = canvas.getBoundingClientRect();
    const scale = canvas.width / box.width;
    return [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
  }
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button || busy) return;
    event.preventDefault();
    const at = placeOf(event);
    if (chosen("tool") === "polygon") {
      const [x, y] = corners[0] || [Infinity, Infinity];
      if (corners.length > 2 && Math.hypot(at[0] - x, at[1] - y) < NEAR_PX * screenScale()) close();
      else corners.push(at);
      pointer = at;
    } else {
      canvas.setPointerCapture(event.pointerId);
      remember();
      stroke = at;
      paint(at);
    }
    draw();
  });
  canvas.addEventListener("pointermove", (event) => {
    pointer = placeOf(event);
    if (stroke) for (const each of event.getCoalescedEvents?.() || [event]) paint(placeOf(each));
    draw();
  });
  canvas.addEventListener("pointerup", () => { stroke = null; });
  canvas.addEventListener("pointercancel", () => { stroke = null; });
  canvas.addEventListener("pointerleave", () => { pointer = null; draw(); });
  canvas.addEventListener("dblclick", () => {
    if (corners.length > 3) { // the second click of the two made a corner beside the first's
      corners.pop();
      close();
    }
  });

  // ---- what is asked of the server
  function whole() { // the mask as a black and white picture
    const whole = document.createElement("canvas");
    whole.width = mask.width;
    whole.height = mask.height;
    const context = whole.getContext("2d");
    context.fillStyle = "#000";
    context.fillRect(0, 0, whole.width, whole.height);
    context.drawImage(mask, 0, 0);
    return whole;
  }
  function typed() { // null: as it is
    return Object.fromEntries(Object.entries(fields).map(([name, { value, defaultValue }]) => [name, value === defaultValue ? null : value]));
  }
  async function sent(address, type, body) {
    const reply = await fetch(address, { method: "POST", headers: { "content-type": type }, body });
    if (reply.ok) return reply;
    let error = `the server says ${reply.status}`;
    try {
      error = (await reply.json()).error || error;
    } catch { /* it said so in no words of its own */ }
    throw new Error(error);
  }
  async function kept(png) { // the outline in base64, null: none
    return (await sent(page, "application/json", JSON.stringify({ png, ...typed() }))).json();
  }
  async function tellName() {
    const name = fields.name.value;
    let told;
    try {
      told = (await (await sent(known.dataset.asked, "application/json", JSON.stringify({ name }))).json()).told;
    } catch (error) {
      told = error instanceof TypeError ? "" : error.message;
    }
    if (name === fields.name.value) known.textContent = told;
  }
  async function busily(words, work) {
    if (busy) return;
    busy = true;
    say(words);
    try {
      await work();
    } catch (error) {
      say(error instanceof TypeError ? "the server does not answer; is the command still running?" : error.message, true);
    } finally {
      busy = false;
    }
  }
  function taken(picture) { // a black and white picture as a mask
    const copy = document.createElement("canvas");
    copy.width = mask.width;
    copy.height = mask.height;
    const context = copy.getContext("2d", { willReadFrequently: true });
    context.drawImage(picture, 0, 0);
    const pixels = context.getImageData(0, 0, copy.width, copy.height);
    for (let at = 0; at < pixels.data.length; at += 4) pixels.data[at + 3] = pixels.data[at];
    context.putImageData(pixels, 0, 0);
    put(copy);
    draw();
  }
  const acts = {
    fit: () => busily("looking for edges ...", async () => {
      const png = await new Promise((done) => { whole().toBlob(done, "image/png"); });
      const reply = await sent(`${page}/fit`, "image/png", png);
      const fitted = await createImageBitmap(await reply.blob());
      remember();
      taken(fitted);
      say("fitted; z takes it back");
    }),
    undo: () => {
      if (corners.length) corners.pop();
      else if (undone.length) put(undone.pop());
      draw();
    },
    clear: () => {
      remember();
      mask.getContext("2d").clearRect(0, 0, mask.width, mask.height);
      draw();
    },
    reset: () => {
      remember();
      put(first);
      draw();
    },
    closer: () => enlarge(1.5),
    farther: () => enlarge(1 / 1.5),
    keep: () => {
      if (corners.length) {
        close();
        return;
      }
      busily("keeping it ...", async () => {
        const reply = await kept(whole().toDataURL("image/png").split(",")[1]);
        changed = retyped = false;
        location.assign(reply.next);
      });
    },
    words: () => busily("keeping them ...", async () => {
      const reply = await kept(null);
      for (const [name, field] of Object.entries(fields)) field.value = field.defaultValue = reply[name];
      retyped = false;
      tellName();
      say("name and size are kept, to be built; s leads to the next photo");
    }),
    later: () => {
      changed = retyped = false;
      location.assign(next);
    },
  };
  for (const button of form.querySelectorAll("[data-act]")) {
    button.addEventListener("click", () => {
      acts[button.dataset.act]();
      button.blur();
    });
  }
  const choices = { p: ["tool", "polygon"], b: ["tool", "brush"], a: ["way", "add"], x: ["way", "remove"] };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (Object.values(fields).includes(event.target)) { // here keys are letters, but for those that lead out of it
      if (event.key !== "Enter" && event.key !== "Escape") return;
      event.preventDefault();
      event.target.blur();
      return;
    }
    const field = form.querySelector(`[data-focus="${CSS.escape(event.key)}"]`);
    const button = form.querySelector(`[data-press="${CSS.escape(event.key)}"]`);
    if (event.key === "Enter" && event.target instanceof HTMLButtonElement) return; // its own
    if (field) {
      field.focus();
      field.select();
    } else if (choices[event.key]) choose(...choices[event.key]);
    else if (button) acts[button.dataset.act]();
    else if (event.key === "Escape") corners = [];
    else if (event.key === "[" || event.key === "]") size.value = Number(size.value) * (event.key === "[" ? 0.8 : 1.25);
    else if (event.key === "h") bare = true;
    else return;
    event.preventDefault();
    draw();
  });
  document.addEventListener("keyup", (event) => {
    if (event.key !== "h") return;
    bare = false;
    draw();
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("change", draw);
  form.addEventListener("input", (event) => { retyped ||= Object.values(fields).includes(event.target); });
  fields.name.addEventListener("change", tellName);
  window.addEventListener("beforeunload", (event) => {
    if (changed || retyped) event.preventDefault();
  });
  window.addEventListener("resize", () => enlarge(1));

  // ---- the beginning
  async function begin() {
    photo.src = photoAddress;
    await photo.decode();
    for (const each of [canvas, mask, tint]) {
      each.width = photo.naturalWidth;
      each.height = photo.naturalHeight;
    }
    const came = new Image();
    came.src = maskAddress;
    await came.decode();
    taken(came);
    first = copyOf(mask);
    enlarge(1);
    form.dataset.ready = "1";
  }
  begin().catch(() => say("the photo cannot be shown; reload the page", true));
})();
