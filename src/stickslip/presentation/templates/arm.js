"use strict";
(() => {
  const film = JSON.parse(document.getElementById("film").textContent);
  const stage = document.getElementById("stage");
  const part = (name) => stage.querySelector(`[data-part="${name}"]`);
  const play = document.getElementById("film-play");
  const scrub = document.getElementById("film-time");
  const speed = document.getElementById("film-speed");
  const clock = document.getElementById("film-clock");
  const reason = document.getElementById("film-reason");
  const strips = [...document.querySelectorAll("#film-phases button")];
  const still = window.matchMedia("(prefers-reduced-motion: reduce)");

  const frames = film.position.length;
  const end = film.step * (frames - 1);
  // Between frames the masses move on straight lines; what is held from sample to sample jumps
  const between = (values, f) => {
    const k = Math.min(Math.floor(f), frames - 2);
    return values[k] + (f - k) * (values[k + 1] - values[k]);
  };
  const held = (values, f) => values[Math.min(Math.floor(f), frames - 1)];
  const place = (name, x) => part(name).setAttribute("transform", `translate(${x.toFixed(2)} 0)`);

  const coils = 9;
  const spring = (from, to, y) => {
    const lead = 9;
    const pitch = (to - from - 2 * lead) / coils;
    let path = `M${from.toFixed(1)} ${y}h${lead}`;
    let x = from + lead;
    for (let k = 0; k < coils; k += 1) {
      path += `L${(x + 0.25 * pitch).toFixed(1)} ${y - 11}L${(x + 0.75 * pitch).toFixed(1)} ${y + 11}`;
      x += pitch;
      path += `L${x.toFixed(1)} ${y}`;
    }
    return `${path}h${lead}`;
  };

  let now = 0;
  const show = (time) => {
    now = Math.min(Math.max(time, 0), end);
    const f = now / film.step;
    const first = film.left + film.scale * between(film.position, f);
    const second = film.left + film.apart + film.scale * between(film.load_position, f);
    place("mass-1", first);
    place("mass-2", second);
    const turn = (second / film.wheel) * (180 / Math.PI);
    for (const wheel of stage.querySelectorAll("[data-wheel]")) {
      wheel.setAttribute("transform", `translate(${wheel.dataset.wheel}) rotate(${turn.toFixed(1)})`);
    }
    part("spring").setAttribute("d", spring(first + film.half, second - film.half, film.height));
    const target = film.left + film.scale * held(film.target, f);
    place("flag-1", target);
    place("flag-2", target + film.apart);
    part("contact").textContent = held(film.resting, f) ? "sticks" : "slides";

    const share = held(film.effort, f) / film.effort_limit;
    const length = film.arrow * share;
    const tip = Math.sign(share) * Math.min(9, Math.abs(length));
    const shaft = length - tip;
    part("arrow").setAttribute(
      "d",
      share === 0 ? "" : `M0 -3H${shaft}V-8L${length} 0L${shaft} 8V3H0Z`,
    );
    const effort = (share * film.effort_limit).toPrecision(2).replace("-", "\u2212");
    part("effort").textContent = `${effort} ${film.unit}`;
    part("effort").setAttribute("visibility", share === 0 ? "hidden" : "visible");
    place("gauge-1", held(film.gauge, f));
    place("gauge-2", held(film.load_gauge, f));

    let k = film.phases.length - 1;
    while (k > 0 && film.phases[k].start > now + 1e-9) k -= 1;
    strips.forEach((strip, j) => {
      if (j === k) strip.setAttribute("aria-current", "true");
      else strip.removeAttribute("aria-current");
    });
    if (k >= 0) {
      part("phase").textContent = film.phases[k].word;
      reason.textContent = `${k + 1} · ${film.phases[k].word}: ${film.phases[k].reason}`;
    }
    clock.textContent = `${now.toFixed(film.decimals)} s`;
    scrub.value = String(now);
    scrub.setAttribute("aria-valuetext", clock.textContent);
  };

  let running = false;
  let last = null;
  const label = () => {
    play.textContent = running ? "❚❚ Pause" : now >= end ? "↺ Again" : "▶ Play";
  };
  const pause = () => {
    running = false;
    label();
  };
  const tick = (stamp) => {
    if (!running) return;
    // Stamps are of the frame, and may be earlier than the click
    last ??= stamp;
    const elapsed = (stamp - last) / 1000;
    // Who wants less motion sees a picture a second
    if (!still.matches || elapsed >= 1) {
      last = stamp;
      show(now + elapsed * Number(speed.value));
    }
    if (now >= end) pause();
    else window.requestAnimationFrame(tick);
  };
  play.addEventListener("click", () => {
    if (running) {
      pause();
      return;
    }
    if (now >= end) show(0);
    running = true;
    last = null;
    label();
    window.requestAnimationFrame(tick);
  });
  scrub.addEventListener("input", () => {
    pause();
    show(Number(scrub.value));
    label();
  });
  for (const strip of strips) {
    strip.addEventListener("click", () => {
      show(Number(strip.dataset.start));
      label();
    });
  }
  show(0);
  label();
})();
