// Sidebar: parameters of the runs, step results, and state at the current time.

const colourOf = (run) => (run.index ? "var(--run-b)" : "var(--run-a)");

function key(run) {
  const made = element("span", { class: "key" }, run.name);
  made.style.setProperty("--colour", colourOf(run));
  return made;
}

// Number of steps with each status that occurs, and of those that failed. Largest residual with a link to
// its step.
function counts(run, setTime) {
  const line = element("div", { class: "counts", "data-run": run.name });
  if (isPair) line.append(key(run));
  for (const [status, steps] of run.data.counts) {
    if (steps === 0 && status !== "failed") continue;
    const name = steps > 0 ? `status-${status}` : "none";
    line.append(element("span", { class: name }, `${status} `, element("b", {}, count(steps))));
  }
  const { worst } = run.data;
  if (worst) {
    const jump = element(
      "button",
      { type: "button", class: "link worst", title: "Go to this step" },
      `largest residual ${number(worst.residual ?? NaN, 2)} m/s at k = ${count(worst.row)}`,
    );
    jump.addEventListener("click", () => setTime(worst.row * run.step));
    line.append(jump);
  }
  return line;
}

// Replaces exponents in a text by powers of ten.
const withPowers = (text) => text.replace(/(\d)e(-?\d+)/g, (_, digit, exponent) => `${digit}\u00b710${raised(exponent)}`);

// List of parameters.
function list(facts) {
  const parameters = element("dl", { class: "parameters" });
  for (const { name, value } of facts) {
    parameters.append(element("div", {}, element("dt", {}, name), element("dd", {}, withPowers(value))));
  }
  return parameters;
}

// Parameters of two runs: first those that differ, then the common ones.
function comparison() {
  const known = runs.map(({ data }) => data.facts.concat(data.record));
  const names = Array.from(new Set(known.flat().map((fact) => fact.name)));
  const parameters = names.map((name) => {
    const values = known.map((facts) => facts.find((fact) => fact.name === name)?.value ?? NOTHING);
    return { name, values, value: values[0], differs: values.some((value) => value !== values[0]) };
  });
  const head = element("tr", {}, element("th", { scope: "row" }, "what differs"));
  head.append(...runs.map((run) => element("th", { scope: "col" }, key(run))));
  const rows = parameters
    .filter(({ differs }) => differs)
    .map(({ name, values }) => {
      const row = element("tr", { class: "differs" }, element("th", { scope: "row" }, name));
      row.append(...values.map((value) => element("td", {}, withPowers(value))));
      return row;
    });
  const table = element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows));
  const same = parameters.filter(({ differs }) => !differs);
  return [table, element("h2", { class: "minor" }, "the same in both"), list(same)];
}

// Notes on data that the page omits.
function omissions() {
  const notes = [];
  for (const run of runs.filter((one) => one.every > 1)) {
    notes.push(
      `${isPair ? `${run.name}: ` : ""}every ${th(run.every)} of ${count(run.rows)} rows is shown, with the ` +
        "mean forces, the largest residual and the worst status of the steps between",
    );
  }
  if (runs.some((run) => run.rows > 4000)) notes.push("curves are thinned and keep every extreme");
  for (const mark of marks.filter((one) => one.rows.length < one.count)) {
    notes.push(
      `${count(mark.rows.length)} of ${count(mark.count)} marks of ${mark.status} steps are shown, evenly chosen`,
    );
  }
  return notes.length ? [element("p", { class: "note" }, `${notes.join("; ")}.`)] : [];
}

function fillFacts(setTime) {
  const facts = document.getElementById("facts");
  facts.className = "card";
  const results = runs.map((run) => counts(run, setTime));
  const { data } = runs[0];
  facts.append(
    ...(isPair ? comparison() : [list(data.facts)]),
    element("div", { id: "body-facts" }),
    element("h2", { class: "minor" }, "Solver"),
    ...results,
    ...(isPair ? [] : [list(data.record)]),
    ...omissions(),
  );
  document.getElementById("made").textContent =
    `made by tumble ${page.version}; motion drawn by three.js, plots by uPlot`;
}

// State at the current time, one line per run.
function fillState() {
  const parent = document.getElementById("state");
  parent.classList.toggle("two-runs", isPair);
  return runs.map((run) => {
    const line = element("dl", { class: "reading", "data-run": run.name });
    const field = (name, className) => {
      const value = element("dd");
      line.append(
        element("div", className ? { class: className } : {}, element("dt", {}, name), value),
      );
      return value;
    };
    if (isPair) field("run", "run").append(key(run));
    const fields = Object.fromEntries(
      ["t", "k", "status", "position", "speed", "residual"].map((name) => [
        name,
        field(name, name),
      ]),
    );
    parent.append(line);
    return { run, fields };
  });
}

// Display choices of fixed objects by name, and one for all of them.
function fillFixed(changed) {
  const names = Array.from(new Set(runs.flatMap((run) => run.data.fixed.map(({ name }) => name))));
  const place = document.getElementById("fixed");
  place.hidden = names.length === 0;
  const choice = (words) => {
    const list = element("select", { "aria-label": `How ${words} is shown` });
    for (const state of ["shown", "faded", "hidden"]) list.append(element("option", {}, state));
    place.append(element("label", { class: "field" }, words, list));
    return list;
  };
  const all = names.length > 1 ? choice("all that stands still") : null;
  const lists = names.map((name) => {
    const list = choice(name || "what stands still");
    list.addEventListener("change", () => changed(name, list.value));
    return list;
  });
  all?.addEventListener("change", () =>
    names.forEach((name, i) => {
      lists[i].value = all.value;
      changed(name, all.value);
    }),
  );
}

// Maximum indentation level of names.
const DEEPEST = 8;

// Bodies in depth-first order of the joint tree, with their depth.
function branches(bodies) {
  const below = bodies.map(() => []);
  bodies.forEach(({ above }, body) => below[above]?.push(body));
  const todo = bodies.flatMap(({ above }, body) => (bodies[above] ? [] : [[body, 0]])).reverse();
  const found = [];
  while (todo.length > 0) {
    const [body, depth] = todo.pop();
    found.push([body, depth]);
    append(todo, below[body].map((other) => [other, depth + 1]).reverse());
  }
  return found;
}

// Fills the list of bodies.
function fillBodies(choose) {
  const list = document.getElementById("body");
  document.getElementById("body-field").hidden = !isCrowd;
  for (const [body, depth] of branches(runs[0].bodies.slice(0, bodyCount))) {
    const indent = "\u2003".repeat(Math.min(depth, DEEPEST));
    list.append(element("option", { value: String(body) }, indent + runs[0].bodies[body].name));
  }
  list.addEventListener("change", () => choose(Number(list.value)));
}

function showBody(body) {
  document.getElementById("body").value = String(body);
  const place = document.getElementById("body-facts");
  place.hidden = !isCrowd;
  place.replaceChildren(
    ...runs.flatMap((run) => {
      const { name, facts } = run.bodies[body];
      const heading = element("h2", { class: "minor" }, ...(isPair ? [key(run), " "] : []), name);
      return [heading, list(facts)];
    }),
  );
}

function showState(lines, time, body) {
  for (const { run, fields } of lines) {
    const frame = run.frame(time);
    const [first, last] = [run.row(frame), Math.min(run.row(frame + 1) - 1, run.rows - 1)];
    const status = page.statuses[run.statuses[frame]];
    const isEnd = frame === run.count - 1;
    put(fields.t, `${fixed(first * run.step, stepDecimals(run.step))} s`);
    put(fields.k, !isEnd && last > first ? `${count(first)} … ${count(last)}` : count(first));
    put(fields.status, isEnd ? "end" : status);
    fields.status.className = `status-${status}`;
    put(
      fields.position,
      `${run
        .position(frame, body)
        .map((x) => fixed(x, run.lengthDecimals))
        .join(", ")} m`,
    );
    put(fields.speed, `${fixed(run.speed(frame, body), run.speedDecimals)} m/s`);
    put(fields.residual, isEnd ? "no step follows" : `${number(run.residuals[frame], 2)} m/s`);
  }
}
