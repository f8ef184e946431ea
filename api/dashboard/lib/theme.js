// @ts-check
/** Light or dark: as the system is, until the reader chooses. */

const KEY = "gaplab-theme";
const systemIsDark = matchMedia("(prefers-color-scheme: dark)");

/** Whether the page is dark now. */
export const isDark = () => (document.documentElement.dataset.theme ?? (systemIsDark.matches ? "dark" : "light")) === "dark";

/** Switch between light and dark, and remember the choice. */
export function switchTheme() {
  const theme = isDark() ? "light" : "dark";
  localStorage.setItem(KEY, theme);
  apply(theme);
}

/** Call a handler after every switch between light and dark, until `signal`. @param {() => void} handler @param {AbortSignal} signal */
export function onTheme(handler, signal) {
  addEventListener("gaplab-theme", handler, { signal });
}

/** @param {string | null} theme */
function apply(theme) {
  if (theme) document.documentElement.dataset.theme = theme;
  dispatchEvent(new Event("gaplab-theme"));
}

systemIsDark.addEventListener("change", () => apply(localStorage.getItem(KEY)));
apply(localStorage.getItem(KEY));
