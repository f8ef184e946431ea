/** Fakes of what a browser has and the test runner lacks; import this file before a script that needs them. */

globalThis.matchMedia = () => ({ matches: false, addEventListener() {} });
globalThis.localStorage = { getItem: () => null, setItem() {} };
globalThis.sessionStorage = { getItem: () => null, setItem() {} };
globalThis.document = { documentElement: { dataset: {} } };

/** Frames that a test asks for one by one. */
export const frames = {
  waiting: [],
  /** Run the callbacks that wait for the next frame, at a time in milliseconds. */
  run(now) {
    for (const callback of frames.waiting.splice(0)) callback(now);
  },
};
globalThis.requestAnimationFrame = (callback) => frames.waiting.push(callback);

/** A parent of elements, and elements that know only where they are. */
export class FakeParent {
  children = [];

  insertBefore(element, before) {
    element.remove();
    element.parent = this;
    this.children.splice(before ? this.children.indexOf(before) : this.children.length, 0, element);
  }
}

export class FakeElement {
  parent = null;

  remove() {
    if (this.parent) this.parent.children = this.parent.children.filter((child) => child !== this);
    this.parent = null;
  }
}

/** A localStorage; one that is full takes nothing. */
export class FakeStorage {
  items = new Map();
  isFull = false;

  get length() { return this.items.size; }

  key(index) { return [...this.items.keys()][index] ?? null; }

  getItem(name) { return this.items.get(name) ?? null; }

  setItem(name, value) {
    if (this.isFull) throw new DOMException("full", "QuotaExceededError");
    this.items.set(name, value);
  }

  removeItem(name) { this.items.delete(name); }
}

/** An element of a page: enough for the scripts that build a view. */
export class FakeNode extends EventTarget {
  parent = null;
  children = [];
  attributes = {};
  dataset = {};
  style = {};
  value = "";

  constructor(tag) {
    super();
    this.tag = tag;
  }

  get textContent() { return this.children.map((child) => child.textContent ?? child).join(""); }

  set textContent(text) { this.replaceChildren(...(text ? [text] : [])); }

  get firstChild() { return this.children[0] ?? null; }

  get lastElementChild() { return this.children.at(-1) ?? null; }

  get childElementCount() { return this.children.length; }

  get isConnected() { return true; }

  hasChildNodes() { return this.children.length > 0; }

  append(...nodes) {
    for (const node of nodes) {
      node.remove?.();
      this.children.push(node);
      if (node instanceof FakeNode) node.parent = this;
    }
  }

  insertBefore(node, before) {
    node.remove();
    this.children.splice(before ? this.children.indexOf(before) : this.children.length, 0, node);
    node.parent = this;
  }

  replaceChildren(...nodes) {
    for (const child of [...this.children]) child.remove?.();
    this.children = [];
    this.append(...nodes);
  }

  remove() {
    if (this.parent) this.parent.children = this.parent.children.filter((child) => child !== this);
    this.parent = null;
  }

  setAttribute(name, value) {
    this.attributes[name] = value;
    if (name === "hidden" || name === "open" || name === "disabled") this[name] = true;
  }

  getAttribute(name) { return this.attributes[name] ?? null; }

  hasAttribute(name) { return name in this.attributes; }

  removeAttribute(name) { delete this.attributes[name]; }

  contains(node) { return node === this || this.children.some((child) => child instanceof FakeNode && child.contains(node)); }

  /** Return the elements below that have one of these tags, classes or attributes, as in `a, p.note, [role]`. */
  querySelectorAll(selectors) {
    const below = (node) => node.children.filter((child) => child instanceof FakeNode).flatMap((child) => [child, ...below(child)]);
    const fits = (node) => selectors.split(", ").some((selector) => {
      const [, tag, cssClass, attribute] = /^([\w-]*)(?:\.([\w-]+))?(?:\[([\w-]+)\])?$/.exec(selector);
      return (!tag || node.tag === tag) && (!cssClass || (node.attributes.class ?? "").split(" ").includes(cssClass)) && (!attribute || attribute in node.attributes);
    });
    return below(this).filter(fits);
  }

  querySelector(selectors) { return this.querySelectorAll(selectors)[0] ?? null; }

  focus() { document.activeElement = this; }

  click() { this.dispatchEvent(new Event("click")); }

  scrollIntoView() {}
}
globalThis.HTMLElement = FakeNode;
globalThis.document.createElement = (tag) => new FakeNode(tag);
