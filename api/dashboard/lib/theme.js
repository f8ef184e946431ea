/** Light or dark: what the system says, until the reader says otherwise. */

const KEY = "gaplab-theme";
const dark = matchMedia("(prefers-color-scheme: dark)");

/** Whether the page is dark now. */
export const isDark = () => (document.documentElement.dataset.theme ?? (dark.matches ? "dark" : "light")) === "dark";

/** The other one. */
export function switchTheme() {
  const theme = isDark() ? "light" : "dark";
  localStorage.setItem(KEY, theme);
  apply(theme);
}

/** Call `handler` whenever light and dark change places. */
export function onTheme(handler, signal) {
  addEventListener("gaplab-theme", handler, { signal });
}

function apply(theme) {
  if (theme) document.documentElement.dataset.theme = theme;
  dispatchEvent(new Event("gaplab-theme"));
}

dark.addEventListener("change", () => apply(localStorage.getItem(KEY)));
apply(localStorage.getItem(KEY));
