// The behavior tree as it runs. Idle nodes are not sent, only their number.

import { attribute, h, list, part, text } from "./dom.js";
import { store } from "./store.js";
import { age } from "./words.js";

const GLYPHS = { RUNNING: "▶", SUCCESS: "✓", FAILURE: "✕", IDLE: "·", SKIPPED: "↷" };

/** Mission seconds for which a failure counts as recent. */
const RECENT_S = 10;

/** Opened or closed by the operator: path -> open. */
const chosen = new Map();

export function mountTree() {
  const body = document.querySelector("#tree .body");
  const facts = h("span", { class: "muted figure", "data-part": "facts" });
  const rows = h("div", { class: "tree", role: "tree", "aria-label": "Behavior tree" });
  body.append(h("div", { class: "chips" }, facts), rows);
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

/** The list in preorder as nodes with their paths and numbers of children. */
function shape(nodes) {
  const counts = [];
  const stack = [];
  return nodes.map((node) => {
    counts.length = node.depth + 1;
    counts[node.depth] = (counts[node.depth] ?? -1) + 1;
    const shaped = { ...node, path: counts.join("."), children: 0, active: node.status !== "IDLE" || isRecent(node) };
    stack.length = Math.min(stack.length, node.depth);
    // A node that failed recently is not folded away with its idle neighbours.
    if (isRecent(node)) for (const above of stack) above.active = true;
    if (node.depth) stack[node.depth - 1].children += 1;
    stack[node.depth] = shaped;
    return shaped;
  });
}

/** A composite resets its children, so that a failed node is idle again at once: only its reason remains. */
function isRecent(node) {
  return Boolean(node.reason) && node.failedAgoS != null && node.failedAgoS < RECENT_S;
}

function isOpen(node) {
  return chosen.get(node.path) ?? node.active;
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
  const kind = node.kind === node.name ? "" : node.kind;
  text(part(row, "kind"), node.folded ? `${kind} +${node.folded} idle` : kind);
  text(part(row, "reason"), node.reason ? `${node.reason}, ${age(node.failedAgoS)} ago` : "");
  attribute(row, "data-status", node.status);
  attribute(row, "data-failed", isRecent(node) ? "true" : null);
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
