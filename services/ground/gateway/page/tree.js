// The behavior tree as it runs. What is idle is folded until somebody opens it.

import { attribute, h, list, part, text } from "./dom.js";
import { store } from "./store.js";

const GLYPHS = { RUNNING: "▶", SUCCESS: "✓", FAILURE: "✕", IDLE: "·", SKIPPED: "↷" };

/** Opened or closed by hand: path -> open. */
const chosen = new Map();
let activeOnly = true;

export function mountTree() {
  const body = document.querySelector("#tree .body");
  const facts = h("span", { class: "muted figure", "data-part": "facts" });
  const toggle = h("button", { class: "chip", id: "tree-active", "aria-pressed": "true", click: () => {
    activeOnly = !activeOnly;
    chosen.clear();
    attribute(toggle, "aria-pressed", String(activeOnly));
  } }, "fold what is idle");
  const rows = h("div", { class: "tree", role: "tree", "aria-label": "Behavior tree" });
  body.append(h("div", { class: "chips" }, toggle, facts), rows);
  rows.addEventListener("keydown", onKey);
  return () => {
    const tree = store.doc?.tree;
    text(facts, tree ? `root ${tree.status || "–"}, ${tree.ticks ?? 0} ticks` : "no tree received");
    const nodes = visible(shape(tree?.nodes ?? []));
    list(rows, nodes, (it) => it.path, make, fill);
    const first = rows.firstElementChild;
    if (first && !rows.querySelector('[tabindex="0"]')) first.tabIndex = 0;
  };
}

/**
 * The list in preorder as nodes with paths. The depth of an included tree counts from its own
 * root: a node at depth 0 hangs below the one before it, and what is too deep for the included
 * tree belongs to the one around it.
 */
function shape(nodes) {
  const frames = [{ base: 0, last: -1 }];
  const counts = [];
  const shaped = nodes.map((node) => {
    let frame = frames.at(-1);
    if (node.depth === 0 && frame.last >= 0) {
      frame = { base: frame.base + frame.last + 1, last: -1 };
      frames.push(frame);
    }
    while (frames.length > 1 && node.depth > frame.last + 1) {
      frames.pop();
      frame = frames.at(-1);
    }
    frame.last = node.depth;
    const depth = frame.base + node.depth;
    counts.length = depth + 1;
    counts[depth] = (counts[depth] ?? -1) + 1;
    return { ...node, depth, path: counts.join("."), children: 0, active: node.status !== "IDLE" };
  });
  const stack = [];
  for (const node of shaped) {
    stack.length = Math.min(stack.length, node.depth);
    const parent = stack[node.depth - 1];
    if (parent) parent.children += 1;
    stack[node.depth] = node;
  }
  return shaped;
}

function isOpen(node) {
  return chosen.get(node.path) ?? (!activeOnly || node.active);
}

function visible(nodes) {
  let closedAt = Infinity;
  return nodes.filter((node) => {
    if (node.depth > closedAt) return false;
    closedAt = node.children && !isOpen(node) ? node.depth : Infinity;
    return true;
  });
}

function make(node) {
  const row = h("div", { role: "treeitem", class: "node", tabindex: "-1" },
    h("span", { class: "twist", "data-part": "twist", "aria-hidden": "true" }),
    h("span", { class: "glyph", "data-part": "glyph" }),
    h("span", { "data-part": "name" }),
    h("span", { class: "kind", "data-part": "kind" }),
    h("span", { class: "reason", "data-part": "reason" }),
  );
  row.addEventListener("click", () => fold(row));
  row.dataset.path = node.path;
  return row;
}

function fill(row, node) {
  row.style.paddingInlineStart = `${4 + node.depth * 13}px`;
  const open = isOpen(node);
  text(part(row, "twist"), node.children ? (open ? "▾" : "▸") : "");
  text(part(row, "glyph"), GLYPHS[node.status] ?? "?");
  attribute(part(row, "glyph"), "title", node.status.toLowerCase());
  text(part(row, "name"), node.name);
  text(part(row, "kind"), node.kind === node.name ? "" : node.kind);
  text(part(row, "reason"), node.reason);
  attribute(row, "data-status", node.status);
  attribute(row, "aria-level", node.depth + 1);
  attribute(row, "aria-expanded", node.children ? String(open) : null);
  row.title = node.reason ? `${node.status.toLowerCase()}: ${node.reason}` : node.status.toLowerCase();
}

function fold(row, open = row.getAttribute("aria-expanded") !== "true") {
  if (row.hasAttribute("aria-expanded")) chosen.set(row.dataset.path, open);
}

function onKey(event) {
  const row = event.target.closest(".node");
  if (!row) return;
  const to = { ArrowDown: row.nextElementSibling, ArrowUp: row.previousElementSibling, Home: row.parentElement.firstElementChild, End: row.parentElement.lastElementChild }[event.key];
  if (to) {
    row.tabIndex = -1;
    to.tabIndex = 0;
    to.focus();
  } else if (event.key === "ArrowRight") fold(row, true);
  else if (event.key === "ArrowLeft") fold(row, false);
  else if (event.key === "Enter" || event.key === " ") fold(row);
  else return;
  event.preventDefault();
}
