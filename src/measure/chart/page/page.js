// What the page can do beyond reading: sort tables, show a point of a chart, enlarge pictures, compare two of them.
"use strict";

// A heading that is pressed sorts its table: numbers by value, words by name, what is missing last.
for (const table of document.querySelectorAll("table")) {
  const headings = [...table.querySelectorAll("th")];
  headings.forEach((heading, column) => heading.querySelector("button")?.addEventListener("click", () => {
    const sign = heading.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    headings.forEach((other) => other.removeAttribute("aria-sort"));
    heading.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
    const value = (row) => row.cells[column].dataset.value ?? "";
    const compare = (a, b) => {
      const [x, y] = [value(a), value(b)];
      if (x === "" || y === "") return (x === "") - (y === "");
      return sign * (heading.classList.contains("word") ? x.localeCompare(y) : x - y);
    };
    const body = table.tBodies[0];
    body.append(...[...body.rows].sort(compare));
  }));
}

// Shows the picture of an id in an <img>: its file beside the page where the page has it smaller, else what is embedded.
function show(img, id) {
  const picture = document.getElementById(id);
  const embedded = picture?.getAttribute("href") ?? "";
  img.onerror = () => { img.onerror = null; img.src = embedded; };
  img.src = picture?.dataset.file ?? embedded;
  img.hidden = !picture;
  if (picture) img.style.aspectRatio = `${picture.getAttribute("width")} / ${picture.getAttribute("height")}`;
  return picture;
}

// The card of a point: the cells of its row whose headings are marked, and its picture.
const card = document.getElementById("card");

function showCard(link) {
  const row = document.getElementById(link.getAttribute("href").slice(1));
  if (!row) return;
  const list = document.createElement("dl");
  [...row.closest("table").querySelectorAll("th")].forEach((heading, column) => {
    const cell = row.cells[column];
    if (heading.dataset.card === undefined || cell.textContent.trim() === "") return;
    const [term, value] = ["dt", "dd"].map((name) => list.appendChild(document.createElement(name)));
    term.textContent = heading.textContent;
    value.append(...cell.cloneNode(true).childNodes);
  });
  const img = new Image();
  show(img, `picture-${row.id}`);
  card.replaceChildren(img, list);
  card.hidden = false;
  const [at, size] = [link.getBoundingClientRect(), card.getBoundingClientRect()];
  const right = at.right + 12;
  const left = right + size.width < innerWidth ? right : at.left - 12 - size.width;
  card.style.left = `${Math.max(0, left)}px`;
  card.style.top = `${Math.max(0, Math.min(at.top, innerHeight - size.height - 8))}px`;
}

// In a chart, Tab goes to one point; arrows go on to its neighbours.
for (const chart of document.querySelectorAll(".chart")) {
  const x = (link) => link.querySelector("circle").cx.baseVal.value;
  const links = [...chart.querySelectorAll("a.point")].sort((a, b) => x(a) - x(b));
  const focusable = (one) => links.forEach((link) => link.setAttribute("tabindex", link === one ? "0" : "-1"));
  focusable(links[0]);
  links.forEach((link, index) => {
    const title = link.querySelector("title");
    link.setAttribute("aria-label", title.textContent);
    title.remove();
    link.addEventListener("pointerenter", () => showCard(link));
    link.addEventListener("focus", () => showCard(link));
    for (const leave of ["pointerleave", "blur", "click"]) link.addEventListener(leave, () => { card.hidden = true; });
    link.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      const next = links[index + (step ?? NaN)];
      if (event.key === "Escape") card.hidden = true;
      if (!next) return;
      event.preventDefault();
      focusable(next);
      next.focus();
    });
  });
}

// A picture that is clicked is enlarged.
const lightbox = document.getElementById("lightbox");
for (const link of document.querySelectorAll("a.picture")) {
  link.addEventListener("click", (event) => {
    const img = lightbox.querySelector("img");
    const picture = show(img, link.getAttribute("href").slice(1));
    if (!picture) return;
    event.preventDefault();
    const caption = picture.closest("svg").getAttribute("aria-label");
    img.alt = caption;
    lightbox.querySelector("p").textContent = caption;
    lightbox.showModal();
  });
}
lightbox.addEventListener("click", (event) => { if (event.target === lightbox) lightbox.close(); });

// Two pictures one over the other; the slider says where the left one ends.
for (const compare of document.querySelectorAll(".compare")) {
  const images = [...compare.querySelectorAll("img")];
  const slider = compare.querySelector("input");
  [...compare.querySelectorAll("select")].forEach((select, side) => {
    const change = () => {
      show(images[side], select.value);
      images[side].alt = select.selectedOptions[0].textContent;
    };
    select.addEventListener("change", change);
    change();
  });
  const move = () => compare.querySelector(".stack").style.setProperty("--left", `${slider.value}%`);
  slider.addEventListener("input", move);
  move();
  compare.hidden = false;
}
