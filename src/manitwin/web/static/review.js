// Judging a twin by keyboard: answers, corrections, drafts. What is confirmed is on the server's disk before the page goes on.
"use strict";
(() => {
  const form = document.getElementById("review");
  if (!form) return;
  const said = document.getElementById("saved");
  const { twin, revision, path, annotator } = form.dataset;
  const sets = [...form.querySelectorAll("[data-dimension]")];
  const maps = [...document.querySelectorAll("[data-map]")];
  const KEPT = "manitwin.review.keys";
  let at = 0;
  let target = null; // the field that a picked candidate goes into
  let before = 0; // seconds of earlier looks
  let shownSince = document.hidden ? null : performance.now();
  let spent = 0;
  let request = id();
  let timer = null;
  let sending = Promise.resolve(); // the draft that is under way: what is confirmed comes after it
  let busy = false;

  function id() {
    return [...crypto.getRandomValues(new Uint8Array(16))].map((each) => each.toString(16).padStart(2, "0")).join("");
  }
  function say(text, wrong) {
    said.textContent = text;
    said.classList.toggle("error", Boolean(wrong));
  }
  function seconds() {
    return before + (spent + (shownSince === null ? 0 : performance.now() - shownSince)) / 1000;
  }
  document.addEventListener("visibilitychange", () => {
    if (document.hidden && shownSince !== null) {
      spent += performance.now() - shownSince;
      shownSince = null;
    } else if (!document.hidden && shownSince === null) shownSince = performance.now();
  });

  // ---- keys
  function readKeys() {
    let kept = {};
    try {
      kept = JSON.parse(localStorage.getItem(KEPT) || "{}");
    } catch { /* what is no map is as none */ }
    for (const field of maps) field.value = kept[field.dataset.map] || field.dataset.default;
    showKeys();
  }
  function keyOf(action) {
    return maps.find((field) => field.dataset.map === action).value;
  }
  function showKeys() {
    for (const mark of document.querySelectorAll("[data-key]")) mark.textContent = keyOf(mark.dataset.key);
  }
  function remap(event) {
    if (event.key === "Tab" || event.key === "Escape" || ["Shift", "Control", "Alt", "Meta"].includes(event.key)) return;
    event.preventDefault();
    event.stopPropagation();
    const other = maps.find((field) => field !== event.target && field.value === event.key);
    if (other || /^[0-9]$/.test(event.key)) {
      say(`${event.key} is taken already`, true);
      return;
    }
    event.target.value = event.key;
    localStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(maps.map((field) => [field.dataset.map, field.value]))));
    showKeys();
    say(`${event.key} it is`);
  }
  for (const field of maps) field.addEventListener("keydown", remap);

  // ---- the form
  function answer(set) {
    const chosen = set.querySelector("input[type=radio]:checked");
    return chosen ? chosen.value : null;
  }
  function go(place) {
    at = Math.max(0, Math.min(sets.length - 1, place));
    sets.forEach((set, each) => set.classList.toggle("current", each === at));
    if (!sets[at]) return;
    sets[at].scrollIntoView({ block: "nearest" });
    if (sets[at].dataset.dimension === "simulation") showLayer("grasps"); // before, they would hide what is judged
  }
  function showFixes() {
    for (const set of sets) {
      const fix = set.querySelector(".fix");
      if (fix) fix.hidden = answer(set) !== "no";
    }
  }
  function showLayer(name) {
    const layer = document.querySelector(`[data-layer=${name}]`);
    if (!layer || layer.checked) return;
    layer.checked = true;
    layer.dispatchEvent(new Event("change", { bubbles: true }));
  }
  function give(value) {
    const radio = sets[at].querySelector(`input[value="${value}"]`);
    radio.checked = true;
    showFixes();
    keep();
    if (value !== "no") go(at + 1);
    else if (sets[at].querySelector("[data-point]")) showLayer("candidate");
  }
  // a draft keeps numbers as they are typed; what is confirmed has them read, and none is left out because it is none
  function number(field) {
    const typed = field.value.trim();
    const read = Number(typed.replace(",", "."));
    if (Number.isFinite(read) && (!field.dataset.point || (Number.isInteger(read) && read >= 0))) return read;
    field.focus();
    const what = field.getAttribute("aria-label") || field.parentElement.textContent.trim();
    throw new Error(`${what}: "${typed}" is no ${field.dataset.point ? "candidate's number" : "number; give one such as 0.25"}`);
  }
  function content(read = (field) => field.value.trim()) {
    const answers = {};
    const corrections = {};
    for (const set of sets) {
      const value = answer(set);
      if (value) answers[set.dataset.dimension] = value;
      if (value !== "no") continue;
      for (const field of set.querySelectorAll("[data-fix], [data-point]")) {
        if (!field.value.trim()) continue;
        if (field.dataset.point) (corrections.points ||= {})[field.dataset.point] = read(field);
        else if (field.dataset.fix === "category") corrections.category = field.value.trim();
        else {
          const [name, end] = field.dataset.fix.split(".");
          (corrections[name] ||= {})[end] = read(field);
        }
      }
    }
    return { revision, answers, corrections, note: form.elements.note.value, seconds: Math.round(10 * seconds()) / 10 };
  }
  function completed(body) {
    for (const name of ["mass_kg", "longest_side_m"]) {
      const measure = body.corrections[name];
      if (!measure) continue;
      if (measure.value === undefined) throw new Error(`${name}: give the value itself, not its interval alone`);
      measure.low ??= measure.value;
      measure.high ??= measure.value;
    }
    return body;
  }
  function restore(draft) {
    before = Number(draft.seconds) || 0;
    for (const set of sets) {
      const value = (draft.answers || {})[set.dataset.dimension];
      const radio = [...set.querySelectorAll("input[type=radio]")].find((each) => each.value === value);
      if (radio) radio.checked = true;
    }
    const fixes = draft.corrections || {};
    for (const field of form.querySelectorAll("[data-fix], [data-point]")) {
      const [name, end] = (field.dataset.fix || "").split(".");
      const kept = field.dataset.point ? (fixes.points || {})[field.dataset.point] : end ? (fixes[name] || {})[end] : fixes[name];
      if (kept !== undefined && kept !== null) field.value = kept;
    }
    form.elements.note.value = draft.note || "";
    const open = sets.findIndex((set) => !answer(set));
    showFixes();
    go(open < 0 ? sets.length - 1 : open);
  }

  // ---- the server
  async function send(place, body) {
    let reply;
    try {
      reply = await fetch(place, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify({ ...body, annotator }) });
    } catch {
      throw new Error("not saved: the server does not answer. Nothing is lost on this page; try again.");
    }
    const told = await reply.json().catch(() => ({ error: `not saved: the server answers ${reply.status}; open its new link` }));
    if (!reply.ok) throw new Error(told.error);
    return told;
  }
  function keep() {
    request = id(); // another review than the one that may have been sent
    clearTimeout(timer);
    timer = setTimeout(keepNow, 400);
  }
  function keepNow() {
    timer = null;
    sending = send(`${path}/${twin}/draft`, content());
    sending.then(() => say("draft kept"), (error) => say(error.message, true));
    return sending;
  }
  // what was typed just now is no less kept where a key leads to another twin
  async function keptBeforeLeaving() {
    if (timer === null) return;
    clearTimeout(timer);
    await keepNow();
  }
  async function guarded(work) {
    if (busy) return;
    busy = true;
    try {
      await work();
    } catch (error) {
      say(error.message, true);
    } finally {
      busy = false;
    }
  }
  const confirm = (whatever) => guarded(async () => {
    const missing = sets.filter((set) => !answer(set)).map((set) => set.dataset.dimension);
    if (missing.length && !whatever) {
      go(sets.findIndex((set) => !answer(set)));
      throw new Error(`not answered: ${missing.join(", ")}`);
    }
    const body = { ...completed(content(number)), request };
    clearTimeout(timer);
    timer = null;
    say("not saved yet …");
    await sending.catch(() => {}); // a draft that arrived later would stay
    say("not saved yet …");
    const told = await send(`${path}/${twin}`, body);
    location.assign(told.next);
  });
  const undo = () => guarded(async () => {
    await keptBeforeLeaving();
    const told = await send(`${path}/undo`, { request: id() });
    if (told.next) location.assign(told.next);
    else say("there is nothing to take back");
  });
  const later = () => guarded(async () => {
    await keptBeforeLeaving();
    location.assign(`${path}?after=${encodeURIComponent(twin)}`);
  });
  const ACTS = {
    yes: () => give("yes"), no: () => give("no"), unsure: () => give("unsure"),
    next: () => go(at + 1), previous: () => go(at - 1),
    correct: () => {
      const field = sets[at].querySelector(".fix:not([hidden]) input");
      if (field) field.focus();
    },
    note: () => form.elements.note.focus(),
    confirm: (event) => confirm(event.shiftKey), undo, later,
    reset: () => {
      localStorage.removeItem(KEPT);
      readKeys();
    },
  };
  const WITHOUT_TWIN = ["undo", "reset"];
  function act(name, event) {
    if (twin || WITHOUT_TWIN.includes(name)) ACTS[name](event);
  }
  document.addEventListener("click", (event) => {
    const button = event.target.closest("[data-act]");
    if (button) act(button.dataset.act, event);
  });
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
    const typing = event.target.closest("input:not([type=radio]):not([type=checkbox]), textarea, select, .stage, summary, a, [data-map]");
    if (event.key === "Escape") {
      event.target.blur();
      return;
    }
    const pressesButton = event.target.closest("button") && (event.key === "Enter" || event.key === " ");
    if (pressesButton) return;
    if (typing) {
      if (event.key === "Enter" && event.target.matches(".fix input")) event.preventDefault(); // the form is not sent
      return;
    }
    const digit = /^[1-9]$/.test(event.key) ? Number(event.key) : 0;
    if (digit && digit <= sets.length) go(digit - 1);
    const isOf = (key) => (field) => field.value === key; // also with Shift or Caps Lock, where no key of its own is that
    const found = maps.find(isOf(event.key)) ?? maps.find(isOf(event.key.toLowerCase()));
    if (!found && !digit) return;
    event.preventDefault();
    if (found) act(found.dataset.map, event);
  });
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("input", () => {
    showFixes();
    keep();
  });
  form.addEventListener("focusin", (event) => {
    if (event.target.dataset.point) target = event.target;
    const set = event.target.closest("[data-dimension]");
    if (set) go(sets.indexOf(set));
  });
  document.addEventListener("twin:picked", (event) => {
    if (!/^c[0-9]+$/.test(event.detail)) return;
    if (!target) {
      say("choose the field of a point first, then click its candidate");
      return;
    }
    target.value = event.detail.slice(1);
    if (document.activeElement.closest(".stage")) document.activeElement.blur(); // keys are those of the review again
    say(`${target.dataset.point} belongs to candidate ${target.value}`);
    keep();
  });
  readKeys();
  if (twin) {
    restore(form.dataset.draft ? JSON.parse(form.dataset.draft) : {});
    form.dataset.ready = "";
  }
})();
