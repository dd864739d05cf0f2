// The gallery without a server: hides the cards that lack a word. On a narrow screen its filters begin closed.
"use strict";
(() => {
  const filters = document.querySelector("details.filters");
  if (filters && matchMedia("(max-width: 50rem)").matches) filters.open = false;
  const form = document.querySelector("form.find");
  if (!form) return;
  form.hidden = false;
  const field = document.getElementById("find");
  const said = document.getElementById("count");
  const all = said.textContent;
  const cards = [...document.querySelectorAll(".card")].map((card) => [card, card.dataset.words]);
  const find = () => {
    const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const [card, text] of cards) {
      card.hidden = !words.every((word) => text.includes(word));
      shown += card.hidden ? 0 : 1;
    }
    said.textContent = words.length ? `${shown} of ${cards.length} with these words` : all;
    history.replaceState(null, "", words.length ? `#${encodeURIComponent(field.value)}` : location.pathname);
  };
  form.addEventListener("submit", (event) => event.preventDefault());
  field.addEventListener("input", find);
  if (location.hash.length > 1) {
    try {
      field.value = decodeURIComponent(location.hash.slice(1));
      find();
    } catch {
      /* no address of this page */
    }
  }
})();
