// Elements, and lists that keep their elements, and so the focus, while they are updated.

/** An element with attributes and children; an attribute that is a function listens to the event of that name. */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name, value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value != null) element.setAttribute(name, value);
  }
  element.append(...children.filter((it) => it != null && it !== false));
  return element;
}

/** Sets the text only when it differs, so that nothing flickers and selections stay. */
export function text(element, value) {
  if (element.textContent !== value) element.textContent = value;
}

/** Sets or removes an attribute, only when it differs. */
export function attribute(element, name, value) {
  const wanted = value === true ? "" : value;
  if (value === false || value == null) {
    if (element.hasAttribute(name)) element.removeAttribute(name);
  } else if (element.getAttribute(name) !== String(wanted)) element.setAttribute(name, wanted);
}

/** Disabled with its reason as a tooltip; enabled when there is no reason. */
export function disabledFor(button, reason) {
  attribute(button, "disabled", Boolean(reason));
  attribute(button, "title", reason || button.dataset.help || null);
}

/**
 * Makes the children of `parent` those of `items`, in order: an item with a known key keeps its
 * element. `make` builds an element, `fill` updates it.
 */
export function list(parent, items, key, make, fill) {
  const known = new Map([...parent.children].map((it) => [it.dataset.key, it]));
  let place = parent.firstElementChild;
  for (const item of items) {
    const id = String(key(item));
    let element = known.get(id);
    if (element) known.delete(id);
    else {
      element = make(item);
      element.dataset.key = id;
    }
    fill(element, item);
    if (element === place) place = place.nextElementSibling;
    else parent.insertBefore(element, place);
  }
  for (const left of known.values()) left.remove();
}

/** The element inside `parent` that carries `data-part="name"`. */
export function part(parent, name) {
  return parent.querySelector(`[data-part="${name}"]`);
}

/** The colours of the present theme, for canvases. */
export function theme() {
  const style = getComputedStyle(document.documentElement);
  return (name) => style.getPropertyValue(`--${name}`).trim();
}

/** Clears a canvas and fits it to its parent, sharp on any screen; its context counts in CSS pixels. */
export function fit(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const scale = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width, height);
  return { context, width, height };
}
