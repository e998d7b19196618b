/** Buttons, fields and rows that all places share. */

import type { ComponentChildren } from "preact";
import { useEffect, useId, useRef, useState } from "preact/hooks";
import { degrees, parseNumber, UNKNOWN } from "../core/format";
import { Icon, type IconName } from "./icon";

interface ButtonProps {
  children: ComponentChildren;
  onClick: () => void;
  kind?: "primary" | "plain" | "subtle";
  disabled?: boolean;
  title?: string;
  icon?: IconName;
  pressed?: boolean;
}

export function Button({
  children,
  onClick,
  kind = "plain",
  disabled,
  title,
  icon,
  pressed,
}: ButtonProps) {
  return (
    <button
      type="button"
      class={`button ${kind}`}
      onClick={onClick}
      disabled={disabled}
      title={title}
      aria-pressed={pressed}
    >
      {icon && <Icon name={icon} size={18} />}
      <span>{children}</span>
    </button>
  );
}

interface IconButtonProps {
  icon: IconName;
  label: string;
  onClick: () => void;
  pressed?: boolean;
  disabled?: boolean;
  hint?: string;
}

/** A square button with a picture; its name is for the ear and the pointer. */
export function IconButton({ icon, label, onClick, pressed, disabled, hint }: IconButtonProps) {
  return (
    <button
      type="button"
      class="icon-button"
      aria-label={label}
      title={hint ?? label}
      aria-pressed={pressed}
      disabled={disabled}
      onClick={onClick}
    >
      <Icon name={icon} />
    </button>
  );
}

/** A name and its value; the age stands beside a value that is older than a second. */
export function Fact({
  name,
  children,
  age = "",
}: {
  name: string;
  children: ComponentChildren;
  age?: string;
}) {
  return (
    <div class="fact">
      <dt>{name}</dt>
      <dd>
        {children}
        {age && <span class="age"> {age}</span>}
      </dd>
    </div>
  );
}

export function Facts({ children }: { children: ComponentChildren }) {
  return <dl class="facts">{children}</dl>;
}

/** The one number that matters. */
export function Figure({ value, name }: { value: string; name: string }) {
  return (
    <div class="figure">
      <span class="figure-value">{value}</span>
      <span class="figure-name">{name}</span>
    </div>
  );
}

/** Something that takes its time: what, for how long already, and how to be rid of it. */
export function Busy({ text, children }: { text: string; children?: ComponentChildren }) {
  const [seconds, setSeconds] = useState(0);
  useEffect(() => {
    const began = performance.now();
    const timer = setInterval(
      () => setSeconds(Math.floor((performance.now() - began) / 1000)),
      500,
    );
    return () => clearInterval(timer);
  }, []);
  return (
    <div class="busy">
      <progress aria-label={text} />
      <div class="row">
        <span role="status">{text}</span>
        {seconds > 0 && <span class="quiet number">{seconds} s</span>}
        {children}
      </div>
    </div>
  );
}

export function Section({
  title,
  children,
  open = true,
}: {
  title: string;
  children: ComponentChildren;
  open?: boolean;
}) {
  return (
    <details class="section" open={open}>
      <summary>{title}</summary>
      {children}
    </details>
  );
}

interface NumberFieldProps {
  label: string;
  /** Metres or radians; null: not set. */
  value: number | null;
  onCommit: (value: number | null) => void;
  unit?: "length" | "angle" | "count";
  placeholder?: string;
  optional?: boolean;
  lowest?: number;
}

function shownNumber(value: number | null, unit: NumberFieldProps["unit"]): string {
  if (value === null) return "";
  if (unit === "angle") return degrees(value, 1).replace(".0", "");
  if (unit === "count") return String(value);
  // Finer than what is only read: somebody types millimetres here.
  return Math.abs(value) < 10
    ? `${Number((value * 100).toFixed(1))} cm`
    : `${Number(value.toFixed(3))} m`;
}

function readNumber(
  text: string,
  value: number | null,
  unit: NumberFieldProps["unit"],
): number | null | undefined {
  if (text.trim() === "") return null;
  const parsed = parseNumber(text);
  if (!parsed) return undefined;
  if (unit === "angle") return (parsed.value * Math.PI) / 180;
  if (unit === "count") return Number.isInteger(parsed.value) ? parsed.value : undefined;
  const metres =
    parsed.unit === "m" || (parsed.unit === "" && value !== null && Math.abs(value) >= 10);
  return metres ? parsed.value : parsed.value / 100;
}

/** A length (cm under 10 m, else m; "1.5 m" and "150 cm" are both read), an angle or a count. */
export function NumberField(props: NumberFieldProps) {
  const {
    label,
    value,
    onCommit,
    unit = "length",
    placeholder = UNKNOWN,
    optional = false,
    lowest,
  } = props;
  const id = useId();
  const [text, setText] = useState<string | null>(null);
  const [wrong, setWrong] = useState(false);
  const commit = () => {
    if (text === null) return;
    const next = readNumber(text, value, unit);
    const usable =
      next !== undefined &&
      (next !== null || optional) &&
      !(lowest !== undefined && next !== null && next < lowest);
    setWrong(!usable);
    if (!usable) return;
    setText(null);
    if (next !== value) onCommit(next ?? null);
  };
  const key = (event: KeyboardEvent) => {
    if (event.key === "Enter") commit();
    if (event.key === "Escape") {
      setText(null);
      setWrong(false);
    }
    if (
      (event.key === "ArrowUp" || event.key === "ArrowDown") &&
      value !== null &&
      unit !== "count"
    ) {
      event.preventDefault();
      const step = (unit === "angle" ? Math.PI / 180 : 0.01) * (event.key === "ArrowUp" ? 1 : -1);
      onCommit(Math.round((value + step) * 1e6) / 1e6);
    }
  };
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <input
        id={id}
        type="text"
        inputMode="decimal"
        value={text ?? shownNumber(value, unit)}
        placeholder={placeholder}
        aria-invalid={wrong}
        onInput={(event) => setText(event.currentTarget.value)}
        onBlur={commit}
        onKeyDown={key}
      />
    </div>
  );
}

export function TextField({
  label,
  value,
  onCommit,
}: {
  label: string;
  value: string;
  onCommit: (text: string) => void;
}) {
  const id = useId();
  const [text, setText] = useState<string | null>(null);
  const commit = () => {
    if (text?.trim() && text !== value) onCommit(text.trim());
    setText(null);
  };
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <input
        id={id}
        type="text"
        maxLength={120}
        value={text ?? value}
        onInput={(event) => setText(event.currentTarget.value)}
        onBlur={commit}
        onKeyDown={(event) => event.key === "Enter" && event.currentTarget.blur()}
      />
    </div>
  );
}

interface ChoiceProps<T extends string> {
  label: string;
  value: T;
  options: readonly { value: T; text: string }[];
  onChange: (value: T) => void;
}

export function Choice<T extends string>({ label, value, options, onChange }: ChoiceProps<T>) {
  const id = useId();
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <select id={id} value={value} onChange={(event) => onChange(event.currentTarget.value as T)}>
        {options.map((option) => (
          <option key={option.value} value={option.value}>
            {option.text}
          </option>
        ))}
      </select>
    </div>
  );
}

/** What a place says while it has nothing to show, with the button for the next step. */
export function Empty({ text, children }: { text: string; children?: ComponentChildren }) {
  return (
    <div class="empty">
      <p>{text}</p>
      {children}
    </div>
  );
}

/** A question that has to be answered. STOP stays above it. */
export function Dialog({
  title,
  children,
  onClose,
}: {
  title: string;
  children: ComponentChildren;
  onClose?: () => void;
}) {
  const box = useRef<HTMLDivElement>(null);
  const id = useId();
  useEffect(() => {
    const before = document.activeElement;
    box.current?.querySelector<HTMLElement>("button")?.focus();
    return () => before instanceof HTMLElement && before.focus();
  }, []);
  const key = (event: KeyboardEvent) => {
    if (event.key === "Escape") onClose?.();
    if (event.key !== "Tab") return;
    const inside = [
      ...(box.current?.querySelectorAll<HTMLElement>("button, input, select, a") ?? []),
    ];
    const edge = event.shiftKey ? inside[0] : inside[inside.length - 1];
    if (document.activeElement !== edge) return;
    event.preventDefault();
    (event.shiftKey ? inside[inside.length - 1] : inside[0])?.focus();
  };
  return (
    <div class="veil">
      <div
        class="dialog panel"
        role="dialog"
        aria-modal="true"
        aria-labelledby={id}
        ref={box}
        onKeyDown={key}
      >
        <h2 id={id}>{title}</h2>
        {children}
      </div>
    </div>
  );
}
