"use strict";

// Numbers come before words and nothing comes last, whichever way a column is sorted.
const keyOf = (cell) => {
  const text = cell.textContent.trim();
  const number = parseFloat(text.replaceAll(",", ""));
  return [text === "" ? 2 : Number.isNaN(number) ? 1 : 0, Number.isNaN(number) ? text.toLowerCase() : number];
};

const sortBy = (table, column, way) => {
  const rows = [...table.tBodies[0].rows].map((row) => [keyOf(row.cells[column]), row]);
  rows.sort(([[kind, one]], [[otherKind, other]]) => kind - otherKind || way * (one > other ? 1 : one < other ? -1 : 0));
  table.tBodies[0].append(...rows.map(([, row]) => row));
};

for (const board of document.querySelectorAll(".board")) {
  const table = board.querySelector("table");
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => head.querySelector("button")?.addEventListener("click", () => {
    const down = head.ariaSort === "ascending";
    heads.forEach((other) => other.removeAttribute("aria-sort"));
    head.ariaSort = down ? "descending" : "ascending";
    sortBy(table, column, down ? -1 : 1);
  }));

  const input = board.querySelector("input");
  if (!input) continue;
  const rows = [...table.tBodies[0].rows];
  const filter = () => {
    const words = input.value.toLowerCase().split(/\s+/);
    for (const row of rows) row.hidden = !words.every((word) => row.textContent.toLowerCase().includes(word));
    board.querySelector("output").value = `${rows.filter((row) => !row.hidden).length} of ${rows.length} rows`;
  };
  input.addEventListener("input", filter);
  filter();
}

const charts = JSON.parse(document.getElementById("charts").textContent);
charts.forEach((chart, place) => vegaEmbed(`#chart-${place}`, chart, {
  actions: false, renderer: "svg", tooltip: { theme: "custom" },
}));

// Films run while they are seen; a press stops one, and who wants less motion starts each himself.
const films = document.querySelectorAll("video");
const onScreen = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) isIntersecting ? target.play() : target.pause();
});
for (const film of films) {
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) film.controls = true;
  else {
    onScreen.observe(film);
    film.addEventListener("click", () => (film.paused ? film.play() : film.pause()));
  }
}

// A closed part has no width to draw in, and what is folded is not printed.
addEventListener("beforeprint", () => document.querySelectorAll("details.more").forEach((part) => { part.open = true; }));
for (const part of document.querySelectorAll("details.more")) {
  part.addEventListener("toggle", () => dispatchEvent(new Event("resize")));
}
