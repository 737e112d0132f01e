// Touches as JSON beside the rows of measurements.csv or frames.csv.
import { readFileSync } from "node:fs";

export const problems = [];
export const check = (right, what) => {
  if (!right && problems.length < 20) problems.push(what);
};

export function rowsOf(path, key = ({ frame }) => Number(frame)) {
  const lines = readFileSync(path, "utf8").trimEnd().split("\n");
  const names = lines[0].split(",");
  return new Map(
    lines.slice(1).map((line) => {
      const cells = line.split(",");
      check(cells.length === names.length, `row of ${cells.length} cells`);
      const row = Object.fromEntries(names.map((name, i) => [name, cells[i]]));
      return [key(row), row];
    }),
  );
}

function same(value, cell, exact) {
  if (cell === "") return value === undefined || value === null;
  if (typeof value === "boolean") return cell === (value ? "1" : "0");
  if (typeof value !== "number") return value === cell;
  if (exact) return Number(cell) === value;
  return Math.abs(value - Number(cell)) <= 0.5000001 * 10 ** -(cell.split(".")[1] ?? "").length;
}

export function compareTouch(touch, rows, exact, found) {
  const row = rows.get(touch.frame);
  check(row !== undefined, `frame ${touch.frame} has no row`);
  if (row === undefined) return;
  for (const [name, field] of Object.entries(touch)) {
    if (!(name in row)) continue;
    if (field === null || typeof field !== "object") {
      check(same(field, row[name], exact), `frame ${touch.frame}: ${name} is ${field}, not ${row[name]}`);
      ++found.cells;
      continue;
    }
    if (!("value" in field)) continue;  // a list
    check(same(field.value, row[name], exact), `frame ${touch.frame}: ${name} is ${field.value}, not ${row[name]}`);
    ++found.cells;
    const unit = (field.unit ?? "").replace(" ", "");
    const error = unit && name.endsWith(unit) ? name.slice(0, -unit.length) + "sd_" + unit : name + "_sd";
    if (error !== name && error in row && "state" in field) {
      check(same(field.standard_error, row[error], exact), `frame ${touch.frame}: ${error} is ${field.standard_error}`);
      ++found.cells;
    }
  }
}
