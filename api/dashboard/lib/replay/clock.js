/** The time of a replay: it runs, stands, is moved by hand, and begins anew at the end. */

/** A clock of so many seconds; `changed(time)` is called at each change of it, `state(playing)` when it starts or stops. */
export function clock(lengthS, { changed, state, signal }) {
  let [time, rate, before, playing] = [0, 1, null, false];

  function tick(now) {
    if (!playing || signal.aborted) return;
    if (before !== null) time += (rate * (now - before)) / 1000;
    before = now;
    if (time > lengthS) time %= lengthS;
    changed(time);
    requestAnimationFrame(tick);
  }

  function play(on = !playing) {
    if (on === playing) return;
    [playing, before] = [on, null];
    if (on && time >= lengthS) time = 0;
    state(on);
    if (on) requestAnimationFrame(tick);
  }

  return {
    play,
    get time() { return time; },
    get playing() { return playing; },
    /** Go to a time. */
    to(wanted) {
      time = Math.min(Math.max(wanted, 0), lengthS);
      changed(time);
    },
    /** How fast it runs: 1 is as in the world. */
    at(speed) { rate = speed; },
  };
}
