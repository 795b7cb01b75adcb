"use strict";

// A click, Enter or Space on a heading sorts its table by that column: upwards first, the other way when asked again.
function sortBy(heading) {
  const row = heading.parentElement, body = heading.closest("table").tBodies[0], column = [...row.children].indexOf(heading);
  const sign = heading.getAttribute("aria-sort") === "ascending" ? -1 : 1;
  for (const other of row.children) other.setAttribute("aria-sort", "none");
  heading.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
  const lines = [...body.rows].map((line) => ({ line, key: line.cells[column].dataset.value }));
  lines.sort((a, b) => compare(a.key, b.key, sign, heading.classList.contains("number")));
  body.append(...lines.map((each) => each.line));
}

// What was not measured comes last either way.
function compare(a, b, sign, isNumber) {
  const noA = a === undefined || (isNumber && isNaN(a)), noB = b === undefined || (isNumber && isNaN(b));
  if (noA || noB) return noA - noB;
  return sign * (isNumber ? Number(a) - Number(b) : a.localeCompare(b, undefined, { numeric: true }));
}

for (const button of document.querySelectorAll("table.sortable th button")) {
  button.addEventListener("click", () => sortBy(button.parentElement));
}

function startSlider(box) {
  const frame = box.querySelector(".frame"), slider = box.querySelector("input[type=range]"), output = box.querySelector("output");
  const rungs = [...box.querySelectorAll(".rung")], choices = [...box.querySelectorAll("input[name=rung]")];
  const show = () => {
    box.style.setProperty("--at", `${slider.value}%`);
    output.textContent = `${slider.value}%`;
  };
  const choose = (chosen) => {
    rungs.forEach((image, index) => { image.hidden = index !== Number(chosen.value); });
    box.querySelector(".tag.right").textContent = chosen.parentElement.textContent.trim();
  };
  const follow = (event) => {
    const place = frame.getBoundingClientRect();
    slider.value = Math.round(100 * (event.clientX - place.left) / place.width);
    show();
  };
  slider.addEventListener("input", show);
  choices.forEach((choice) => choice.addEventListener("change", () => choose(choice)));
  frame.addEventListener("pointerdown", (event) => { frame.setPointerCapture(event.pointerId); follow(event); });
  frame.addEventListener("pointermove", (event) => { if (event.buttons) follow(event); });
  choose(choices.find((choice) => choice.checked) || choices[0]);
  show();
}

const comparison = document.getElementById("compare");
if (comparison) startSlider(comparison);
