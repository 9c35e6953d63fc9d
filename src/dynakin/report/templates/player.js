(function () {
  "use strict";
  var root = document.getElementById("player");
  var data = JSON.parse(document.getElementById("player-data").textContent);
  var stage = root.querySelector(".stage"), slider = root.querySelector("input"), button = root.querySelector("button");
  var speed = root.querySelector("select"), clock = root.querySelector("output"), cursor = root.querySelector(".cursor");
  var still = window.matchMedia("(prefers-reduced-motion: reduce)");
  var times = data.time, last = times.length - 1, frame = 0, playing = false, from = 0, since = 0;

  function unpack(packed) {
    var text = atob(packed.values), bytes = new Uint8Array(text.length), view, k;
    for (k = 0; k < text.length; k++) { bytes[k] = text.charCodeAt(k); }
    view = new DataView(bytes.buffer);
    return function (row, column) {
      var value = view.getInt16(2 * (row * packed.columns + column), true);
      return value === -32768 ? NaN : value * packed.scale;
    };
  }
  var points = unpack(data.points), arrows = unpack(data.arrows), forces = unpack(data.forces);
  var angles = unpack(data.angles), moments = unpack(data.moments);
  var kinds = [["measured", unpack(data.measured)], ["estimated", unpack(data.estimated)]];
  function all(selector) { return Array.prototype.slice.call(root.querySelectorAll(selector)); }
  var bones = all(".bone"), joints = all(".joint"), rows = all("tbody tr.coordinate"), sizes = all(".size");
  var dots = { measured: all(".dot.measured"), estimated: all(".dot.estimated") };
  var lines = all(".arrow");

  function line(element, x1, y1, x2, y2) {
    var seen = isFinite(x1 + y1 + x2 + y2);
    element.style.display = seen ? "" : "none";
    if (!seen) { return; }
    element.setAttribute("x1", x1); element.setAttribute("y1", y1);
    element.setAttribute("x2", x2); element.setAttribute("y2", y2);
  }
  function dot(element, x, y) {
    var seen = isFinite(x + y);
    element.style.display = seen ? "" : "none";
    if (seen) { element.setAttribute("cx", x); element.setAttribute("cy", y); }
  }
  function text(value, digits, unit) {
    if (!isFinite(value)) { return "–"; }
    var rounded = value.toFixed(digits);
    if (Number(rounded) === 0) { rounded = (0).toFixed(digits); }
    return rounded.replace("-", "−") + " " + unit;
  }
  function show(k) {
    frame = Math.max(0, Math.min(last, k));
    bones.forEach(function (bone, i) {
      var a = data.bones[i][0], b = data.bones[i][1];
      line(bone, points(frame, 2 * a), points(frame, 2 * a + 1), points(frame, 2 * b), points(frame, 2 * b + 1));
      dot(joints[i], points(frame, 2 * a), points(frame, 2 * a + 1));
    });
    var middle = 0, count = 0;
    kinds.forEach(function (kind) {
      dots[kind[0]].forEach(function (element, i) {
        var x = kind[1](frame, 2 * i), y = kind[1](frame, 2 * i + 1);
        dot(element, x, y);
        if (isFinite(x)) { middle += x; count += 1; }
      });
    });
    lines.forEach(function (arrow, i) {
      line(arrow, arrows(frame, 4 * i), arrows(frame, 4 * i + 1), arrows(frame, 4 * i + 2), arrows(frame, 4 * i + 3));
    });
    if (data.follow && count) {
      stage.setAttribute("viewBox", [middle / count - data.view[2] / 2, data.view[1], data.view[2], data.view[3]].join(" "));
    }
    rows.forEach(function (row, i) {
      var unit = data.units[i];
      row.cells[1].textContent = text(angles(frame, i), 1, unit[0]);
      row.cells[2].textContent = text(moments(frame, i), 1, unit[1]);
    });
    sizes.forEach(function (cell, i) { cell.textContent = text(forces(frame, i), 0, "N"); });
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
}());
