// Fields that commit a value once it is complete, and sliders that are followed while they move.
import type { ComponentChildren } from "preact";
import { useEffect, useId, useRef } from "preact/hooks";
import type { Summary } from "../api/types";
import { stop } from "../products/working";
import { accept, busy, refusals, refuse, type Mode } from "../state";
import { fromMetres, toMetres, unit } from "../units";
import { words } from "../words";

interface NumberProps {
  readonly label: string;
  readonly value: number | null;
  readonly min?: number;
  readonly max?: number;
  readonly step?: number | "any";
  readonly optional?: boolean;
  readonly where: Mode;
  readonly onValue: (value: number | null) => void;
}

export function NumberField({ label, value, min, max, step = "any", optional, where, onValue }: NumberProps) {
  const id = useId();
  const commit = (input: HTMLInputElement): void => {
    const empty = input.value.trim() === "";
    const wanted = words.wantsNumber(label, min, max, step === 1);
    // what is no number reads as empty
    if (empty && optional && !input.validity.badInput) onValue(null);
    else if (empty || !input.validity.valid) {
      refuse(where, wanted);
      return;
    } else onValue(input.valueAsNumber);
    if (refusals.peek()[where] === wanted) accept(where);
  };
  const limits = { ...(min === undefined ? {} : { min }), ...(max === undefined ? {} : { max }) };
  return (
    <label class="field" for={id}>
      <span>{label}</span>
      <input id={id} type="number" step={step} {...limits} value={value ?? ""} onChange={(event) => commit(event.currentTarget)} />
    </label>
  );
}

type LengthProps = Omit<NumberProps, "max" | "step">;

/** A length that is kept in metres, and told and typed in metres or feet. */
export function LengthField({ label, value, min, onValue, ...others }: LengthProps) {
  const told = (metres: number): number => Number(fromMetres(metres).toFixed(3));
  const limit = min === undefined ? {} : { min: told(min) };
  return (
    <NumberField
      {...others}
      {...limit}
      label={`${label}, ${unit.value}`}
      value={value === null ? null : told(value)}
      onValue={(typed) => onValue(typed === null ? null : toMetres(typed))}
    />
  );
}

interface TextProps {
  readonly label: string;
  readonly value: string;
  readonly onValue: (value: string) => void;
}

export function TextField({ label, value, onValue }: TextProps) {
  const id = useId();
  return (
    <label class="field" for={id}>
      <span>{label}</span>
      <input id={id} type="text" value={value} onChange={(event) => onValue(event.currentTarget.value)} />
    </label>
  );
}

interface SelectProps<T extends string> {
  readonly label: string;
  readonly value: T;
  readonly options: Readonly<Record<T, string>>;
  readonly onValue: (value: T) => void;
}

export function Select<T extends string>({ label, value, options, onValue }: SelectProps<T>) {
  const id = useId();
  const entries = Object.entries(options) as [T, string][];
  return (
    <label class="field" for={id}>
      <span>{label}</span>
      <select id={id} value={value} onChange={(event) => onValue(event.currentTarget.value as T)}>
        {entries.map(([name, text]) => (
          <option key={name} value={name}>
            {text}
          </option>
        ))}
      </select>
    </label>
  );
}

/** How exact an answer is: for who asks, as it is long. */
export function Exactness({ of: { mode, error_statement, curvature } }: { of: Summary }) {
  return (
    <details>
      <summary>{words.ui.exactness}</summary>
      <p class="hint">{words.ui.trust(mode, error_statement, curvature)}</p>
    </details>
  );
}

/** Stops what is worked on under these names; there while something is. */
export function Stop({ of }: { of: readonly string[] }) {
  const running = of.filter((name) => name in busy.value);
  return (
    running.length > 0 && (
      <button type="button" onClick={() => running.forEach(stop)}>
        {words.ui.cancel}
      </button>
    )
  );
}

interface SliderProps {
  readonly label: string;
  readonly told: string;
  readonly value: number;
  readonly min: number;
  readonly max: number;
  readonly step: number;
  readonly onMove: (value: number) => void;
  readonly onRest?: (value: number) => void;
}

export function Slider({ label, told, value, min, max, step, onMove, onRest }: SliderProps) {
  const id = useId();
  return (
    <div class="slider">
      <label for={id}>
        {label} <output for={id}>{told}</output>
      </label>
      <input
        id={id}
        type="range"
        {...{ min, max, step }}
        value={value}
        aria-valuetext={told}
        onInput={(event) => onMove(event.currentTarget.valueAsNumber)}
        onChange={(event) => onRest?.(event.currentTarget.valueAsNumber)}
      />
    </div>
  );
}

export function Check({ label, value, onValue }: { label: string; value: boolean; onValue: (value: boolean) => void }) {
  return (
    <label class="check">
      <input type="checkbox" checked={value} onChange={(event) => onValue(event.currentTarget.checked)} /> {label}
    </label>
  );
}

export function Facts({ rows }: { rows: readonly (readonly [string, string])[] }) {
  return (
    <dl class="facts">
      {rows.map(([name, value]) => (
        <div key={name}>
          <dt>{name}</dt>
          <dd>{value}</dd>
        </div>
      ))}
    </dl>
  );
}

const arrived = new WeakSet<object>();

/** An answer that comes into view when it arrives, however far down it stands; once, so that a mode is entered at its top. */
export function Arriving({ id, of, children }: { id: string; of: object; children: ComponentChildren }) {
  const at = useRef<HTMLDivElement>(null);
  useEffect(() => {
    if (!arrived.has(of)) at.current?.scrollIntoView({ block: "nearest" });
    arrived.add(of);
  }, [of]);
  return (
    <div id={id} ref={at} class="group" aria-live="polite">
      {children}
    </div>
  );
}

export function Group({ title, id, children }: { title: string; id?: string; children: ComponentChildren }) {
  return (
    <section class="group" {...(id === undefined ? {} : { id })}>
      <h3>{title}</h3>
      {children}
    </section>
  );
}
