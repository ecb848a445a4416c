// Reference runs of the command line, named by TUMBLE.

import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const ROOT = new URL("../../", import.meta.url).pathname;

export const scene = (name) => readFileSync(join(ROOT, "scenarios", `${name}.toml`), "utf8");

// Rows of a table as objects of texts.
function rows(file) {
  const [head, ...lines] = readFileSync(file, "utf8").trimEnd().split("\n");
  const names = head.split(",");
  return lines.map((line) => {
    const cells = line.split(",");
    return Object.fromEntries(names.map((name, place) => [name, cells[place]]));
  });
}

// Tables of a run of the command line.
export function tables(name, steps) {
  const tumble = process.env.TUMBLE;
  if (!tumble) throw new Error("TUMBLE does not name the command line; use scripts/npm");
  const out = mkdtempSync(join(tmpdir(), "tumble-npm-"));
  try {
    const file = join(ROOT, "scenarios", `${name}.toml`);
    execFileSync(tumble, ["run", file, "--steps", String(steps + 1), "--exact", "--quiet", "--out", join(out, "run")]);
    const table = (of) => rows(join(out, "run", `${of}.csv`));
    return { states: table("states"), contacts: table("contacts"), steps: table("steps") };
  } finally {
    rmSync(out, { recursive: true });
  }
}

const COLUMNS = "x_m y_m z_m qw qx qy qz vx_m_s vy_m_s vz_m_s wx_rad_s wy_rad_s wz_rad_s".split(" ");
const CONTACT_COLUMNS = ["point", "normal", "force", "slip"].map((name) => {
  const unit = { point: "_m", normal: "", force: "_N", slip: "_m_s" }[name];
  return [name, ["x", "y", "z"].map((axis) => `${name}_${axis}${unit}`)];
});

// Numbers of a row of states.csv.
export const stateNumbers = (row) => COLUMNS.map((name) => Number(row[name]));

// Contact of a row of contacts.csv, without its friction.
export const contactOf = (row) => ({
  body: Number(row.body),
  partner: row.partner,
  partnerIndex: Number(row.partner_index),
  ...Object.fromEntries(CONTACT_COLUMNS.map(([name, columns]) => [name, columns.map((column) => Number(row[column]))])),
});

// Rows of contacts.csv that hold in step k, in the order of the contacts.
export const contactsOf = (reference, k) =>
  reference.contacts
    .filter((row) => Number(row.k) <= k && k <= Number(row.last_k))
    .sort((a, b) => Number(a.contact) - Number(b.contact));

// Bits of numbers, in which 0 and −0 differ.
export const bits = (numbers) => Array.from(new BigUint64Array(Float64Array.from(numbers).buffer), String);
