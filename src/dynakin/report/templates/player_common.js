var dynakinPlayer = (function () {
  "use strict";
  function unpack(packed) {
    var text = atob(packed.values), bytes = new Uint8Array(text.length), view, k;
    for (k = 0; k < text.length; k++) { bytes[k] = text.charCodeAt(k); }
    view = new DataView(bytes.buffer);
    return function (row, column) {
      var value = view.getInt16(2 * (row * packed.columns + column), true);
      return value === -32768 ? NaN : value * packed.scale;
    };
  }
  function text(value, digits, unit) {
    if (!isFinite(value)) { return "–"; }
    var rounded = value.toFixed(digits);
    if (Number(rounded) === 0) { rounded = (0).toFixed(digits); }
    return rounded.replace("-", "−") + (unit ? " " + unit : "");
  }
  // Clock, slider and button; draw(k) shows frame k. Returns what moves them.
  function run(root, times, draw) {
    var slider = root.querySelector("input"), button = root.querySelector(".controls button");
    var speed = root.querySelector("select"), clock = root.querySelector("output"), cursor = root.querySelector(".cursor");
    var still = window.matchMedia("(prefers-reduced-motion: reduce)");
    var last = times.length - 1, frame = 0, playing = false, from = 0, since = 0;
    function show(k) {
      frame = Math.max(0, Math.min(last, k));
      draw(frame);
      var now = times[frame].toFixed(2) + " s";
      clock.textContent = now;
      slider.value = frame;
      slider.setAttribute("aria-valuetext", now);
      if (cursor) {
        var share = 1000 * (times[frame] - times[0]) / Math.max(times[last] - times[0], 1e-9);
        cursor.setAttribute("x1", share); cursor.setAttribute("x2", share);
      }
    }
    function at(time) {
      var low = 0, high = last;
      while (low < high) {
        var half = (low + high + 1) >> 1;
        if (times[half] <= time) { low = half; } else { high = half - 1; }
      }
      return low;
    }
    function play(on) {
      playing = on;
      root.classList.toggle("playing", on);
      button.lastChild.textContent = on ? "Pause" : "Play";
      if (!on) { return; }
      if (frame === last) { show(0); }
      from = times[frame]; since = performance.now();
      var drawn = since;
      requestAnimationFrame(function step(instant) {
        if (!playing) { return; }
        var reached = at(from + Number(speed.value) * Math.max(0, instant - since) / 1000);
        // Who asked for less motion gets a still picture every second instead of a film.
        if (reached !== frame && (!still.matches || instant - drawn > 1000 || reached === last)) {
          show(reached); drawn = instant;
        }
        if (reached === last) { play(false); } else { requestAnimationFrame(step); }
      });
    }
    button.addEventListener("click", function () { play(!playing); });
    slider.addEventListener("input", function () { play(false); show(Number(slider.value)); });
    speed.addEventListener("change", function () { from = times[frame]; since = performance.now(); });
    root.classList.add("ready");
    show(Number(root.getAttribute("data-start")) || 0);
    return { toggle: function () { play(!playing); }, redraw: function () { draw(frame); } };
  }
  return { unpack: unpack, text: text, run: run };
}());
