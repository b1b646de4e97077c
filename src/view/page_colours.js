// Ways to colour bodies, each {name, legend(), of(body, state, frame) -> [r, g, b]}.

const RAMP = [[68, 40, 120], [59, 82, 139], [33, 145, 140], [94, 201, 98], [240, 215, 50]];
const HEAT = [[120, 150, 185], [238, 205, 110], [222, 110, 45], [165, 25, 40]];
function ramp(colours, share) {
  const at = Math.max(0, Math.min(0.9999, share)) * (colours.length - 1);
  const i = Math.floor(at), part = at - i;
  return colours[i].map((low, c) => low + part * (colours[i + 1][c] - low));
}
const css = (c) => `rgb(${c.map(Math.round).join(",")})`;

// Colours follow the square root of the value: the middle colour is a quarter of the end.
function byRamp(key, name, colours, most, ends, share) {
  return {
    key, name,
    of: (body, state, frame) => ramp(colours, Math.sqrt(share(body, frame) / most)),
    legend: () => `<div class="ramp" style="background:linear-gradient(90deg,${colours.map(css).join(",")})"></div>` +
      `<div class="ends">${ends.map((text) => `<span>${text}</span>`).join("")}</div>`,
  };
}

// `classes`: [text, colour, test(state)]; the first match counts.
function byState(name, classes) {
  const find = (state) => classes.findIndex(([, , fits]) => fits(state));
  return {
    name, classes, find,
    of: (body, state) => classes[find(state)][1],
    legend: (counts) => classes.map(([text, colour], i) =>
      counts[i] ? `<div class="chip"><i style="background:${css(colour)}"></i>${text}<span class="n">${counts[i].toLocaleString("en")}</span></div>` : "").join(""),
  };
}

const FIXED = [150, 154, 160];
const SOUND_OVERLAP = 0.02;  // in mean diameters: overlaps up to this count as sound

function colourings(trajectory, about) {
  const { colour } = trajectory;
  const has = (flag) => (about.states & flag) !== 0;
  const list = [{ key: "body", name: "Colours: scene", legend: () => "",
    of: (body) => [colour[4 * body], colour[4 * body + 1], colour[4 * body + 2]] }];
  list.push({ key: "state", ...byState("Colours: state", [
    ["held by the guide", [60, 160, 150], (s) => s & STATE.frozen],
    ["waiting", [150, 110, 190], (s) => s & STATE.held],
    ["asleep", [88, 122, 160], (s) => s & STATE.asleep],
    ["awake", [226, 122, 52], () => true]]) });
  const fastest = about.fast_m_s;
  list.push(byRamp("speed", "Colours: speed", RAMP, fastest, ["0", rounded(fastest / 4), rounded(fastest) + " m/s"],
    (body, frame) => trajectory.speed(body, frame) * about.frame_rate));
  if (trajectory.moments.length > 0) {
    list.push(byRamp("overlap", "Colours: overlap", HEAT, 4 * SOUND_OVERLAP,
      ["0", percent(SOUND_OVERLAP), percent(4 * SOUND_OVERLAP)], (body, frame) => trajectory.overlap(body, frame)));
  }
  if (has(STATE.impulse) && about.mode === "mixed") {
    list.push({ key: "level", ...byState("Colours: level", [
      ["sphere", [90, 150, 205], (s) => !(s & STATE.impulse)],
      ["near exact ones", [235, 190, 70], (s) => s & STATE.statistical],
      ["exact", [205, 75, 50], () => true]]) });
  }
  if (has(STATE.passed) || has(STATE.failed)) {
    list.push({ key: "analysis", ...byState("Colours: analysis", [
      ["filtered out", [225, 170, 60], (s) => (s & STATE.passed) && (s & STATE.failed)],
      ["may be held", [70, 150, 95], (s) => s & STATE.passed],
      ["cannot stand", [200, 70, 55], (s) => s & STATE.failed],
      ["not looked at", FIXED, () => true]]) });
  }
  return list;
}

function metres(value) {
  return (+value.toFixed(3) + 0).toFixed(3) + " m";  // no -0
}

const percent = (share) => rounded(100 * share) + " %";

// Three digits, without trailing zeros.
function rounded(value) {
  return value === 0 ? "0" : Math.abs(value) >= 1000 ? Math.round(value).toLocaleString("en") : String(+value.toPrecision(3));
}
