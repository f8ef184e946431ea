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
