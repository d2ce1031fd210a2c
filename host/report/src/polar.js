"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const circles = JSON.parse($("profiles").textContent);
  const svg = $("polar"), readout = $("readout"), pick = $("circle"), zoom = $("magnification");
  const NOMINAL = 125, REACH = 60, SECTORS = 180, NS = svg.namespaceURI;
  const KINDS = ["measured", "before", "after"];
  const checked = (name) => [...document.querySelectorAll(`input[name=${name}]:checked`)].map((i) => i.value);
  const signed = (v) => (v < 0 ? "−" : "+") + Math.abs(v).toFixed(1);
  const grouped = (v) => String(v).replace(/\B(?=(\d{3})+$)/g, "\u202f");
  let sector = 0;

  const option = (select, value, text) => {
    const o = document.createElement("option");
    o.value = value; o.textContent = text; select.append(o);
  };
  circles.forEach((c, i) => option(pick, i, c.label));
  option(zoom, "auto", "fit to the page");
  for (const m of [50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000]) option(zoom, m, `× ${grouped(m)}`);
  // The fastest turn shows most.
  let fastest = 0;
  circles.forEach((c, i) => { if (parseFloat(c.label.split(", ")[2]) > parseFloat(circles[fastest].label.split(", ")[2])) fastest = i; });
  if (circles.length) pick.value = fastest;

  const shown = () => {
    const circle = circles[pick.value], ways = checked("way"), curves = checked("curve");
    if (!circle) return { circle: null, lines: [] };
    const lines = [];
    for (const run of circle.runs) if (ways.includes(run.d))
      for (const kind of KINDS) if (curves.includes(kind)) lines.push({ run, kind, values: run[kind] });
    return { circle, lines };
  };
  const nice = (v) => { const p = 10 ** Math.floor(Math.log10(v)); return p * (v / p >= 5 ? 5 : v / p >= 2 ? 2 : 1); };
  const magnification = (circle, lines) => {
    if (zoom.value !== "auto") return Number(zoom.value);
    let most = 0.5;
    for (const l of lines) for (const v of l.values) if (v !== null) most = Math.max(most, Math.abs(v));
    return Math.max(1, nice(REACH / (most * 1e-3 * NOMINAL / circle.r)));
  };
  const add = (name, attributes, text) => {
    const e = document.createElementNS(NS, name);
    for (const k in attributes) e.setAttribute(k, attributes[k]);
    if (text !== undefined) e.textContent = text;
    svg.append(e); return e;
  };
  let hand = null;

  const draw = () => {
    svg.replaceChildren();
    const { circle, lines } = shown();
    if (!circle) return;
    const m = magnification(circle, lines);
    // Pixels a micrometre.
    const scale = m * 1e-3 * NOMINAL / circle.r;
    const step = nice(40 / scale);
    for (let k = -6; k <= 6; k++) {
      const r = NOMINAL + k * step * scale;
      if (k === 0 || r < 15 || r > 196) continue;
      add("circle", { r: r.toFixed(2), class: "grid" });
      add("text", { x: 3, y: (-r - 2).toFixed(1) }, `${signed(k * step).replace(/\.0$/, "")} µm`);
    }
    for (let a = 0; a < 360; a += 45) {
      const [c, s] = [Math.cos(a * Math.PI / 180), Math.sin(a * Math.PI / 180)];
      add("path", { class: "grid", d: `M${(15 * c).toFixed(1)} ${(-15 * s).toFixed(1)}L${(182 * c).toFixed(1)} ${(-182 * s).toFixed(1)}` });
      if (a % 90 === 0 && a !== 90) add("text", { x: (188 * c).toFixed(1), y: (-188 * s + 4).toFixed(1), "text-anchor": "middle" }, `${a}°`);
    }
    add("circle", { r: NOMINAL, class: "nominal" });
    for (const { run, kind, values } of lines) {
      let d = "", pen = false;
      for (let k = 0; k <= SECTORS; k++) {
        const v = values[k % SECTORS];
        if (v === null) { pen = false; continue; }
        const r = Math.max(0, NOMINAL + v * scale), a = (2 * (k % SECTORS) + 1) * Math.PI / 180;
        d += `${pen ? "L" : "M"}${(r * Math.cos(a)).toFixed(2)} ${(-r * Math.sin(a)).toFixed(2)}`;
        pen = true;
      }
      if (d) add("path", { class: `polar-line ${run.d} ${kind}`, d });
    }
    add("text", { x: -196, y: -186 }, `× ${grouped(m)}`);
    hand = add("path", { class: "hand" });
    point();
  };
  const point = () => {
    const { circle, lines } = shown(), angle = 2 * sector + 1, a = angle * Math.PI / 180;
    if (!circle || !hand) return;
    hand.setAttribute("d", `M0 0L${(196 * Math.cos(a)).toFixed(1)} ${(-196 * Math.sin(a)).toFixed(1)}`);
    const parts = new Map();
    for (const { run, kind, values } of lines) {
      const name = `${run.d} (${run.file})`, v = values[sector];
      if (!parts.has(name)) parts.set(name, []);
      parts.get(name).push(`${kind === "measured" ? "measured" : `left ${kind}`} ${v === null ? "–" : `${signed(v)} µm`}`);
    }
    const text = [...parts].map(([name, values]) => `${name}: ${values.join(", ")}`);
    readout.textContent = [`${2 * sector}° to ${2 * sector + 2}°`, ...text].join("\n");
    svg.setAttribute("aria-valuenow", 2 * sector);
    svg.setAttribute("aria-valuetext", [`${2 * sector} degrees`, ...text].join("; "));
  };
  const turn = (to) => { sector = ((to % SECTORS) + SECTORS) % SECTORS; point(); };

  svg.addEventListener("pointermove", (e) => {
    const box = svg.getBoundingClientRect();
    const x = e.clientX - box.left - box.width / 2, y = box.top + box.height / 2 - e.clientY;
    turn(Math.floor(((Math.atan2(y, x) * 180 / Math.PI + 360) % 360) / 2));
  });
  svg.addEventListener("keydown", (e) => {
    const by = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 15, PageDown: -15 }[e.key];
    const to = e.key === "Home" ? 0 : e.key === "End" ? SECTORS - 1 : by === undefined ? null : sector + by;
    if (to !== null) { turn(to); e.preventDefault(); }
  });
  document.querySelector(".controls").addEventListener("change", draw);
  document.querySelector(".controls").addEventListener("submit", (e) => e.preventDefault());
  addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((d) => { d.open = true; }));
  draw();
})();
