/** Small line icons, drawn on a 24 pixel square. */

const PATHS = {
  select: "M5 3l14 8-6 1.5L10 19z",
  boundary: "M4 6l7-3 9 4-1 12-13 2z",
  island: "M4 6h16v12H4z M10 6l-6 6 M16 6L4 18 M20 8L10 18 M20 14l-4 4",
  wall: "M4 20L20 4",
  nogo: "M12 12m-9 0a9 9 0 1018 0 9 9 0 10-18 0 M5.7 5.7l12.6 12.6",
  landmark: "M9 2h6v20H9z M9 6h6 M9 10h6 M9 14h6 M9 18h6",
  route: "M5 19h8a3 3 0 000-6H9a3 3 0 010-6h10 M16 4l3 3-3 3",
  start: "M12 12m-9 0a9 9 0 1018 0 9 9 0 10-18 0 M9 8l7 4-7 4z",
  undo: "M9 7L4 12l5 5 M4 12h10a6 6 0 016 6",
  redo: "M15 7l5 5-5 5 M20 12H10a6 6 0 00-6 6",
  save: "M4 4h13l3 3v13H4z M8 4v5h7V4 M8 20v-6h8v6",
  fit: "M4 9V4h5 M20 9V4h-5 M4 15v5h5 M20 15v5h-5",
  plus: "M12 5v14 M5 12h14",
  minus: "M5 12h14",
  follow: "M12 12m-6 0a6 6 0 1012 0 6 6 0 10-12 0 M12 2v5 M12 17v5 M2 12h5 M17 12h5",
  precision:
    "M12 12m-9 0a9 9 0 1018 0 9 9 0 10-18 0 M12 12m-5 0a5 5 0 1010 0 5 5 0 10-10 0 M12 12m-1 0a1 1 0 102 0 1 1 0 10-2 0",
  trash: "M5 7h14 M10 7V4h4v3 M7 7l1 13h8l1-13",
  copy: "M8 8h12v12H8z M4 16V4h12",
  close: "M6 6l12 12 M18 6L6 18",
  play: "M7 4l13 8-13 8z",
  pause: "M8 5v14 M16 5v14",
  back: "M15 5l-7 7 7 7",
  right: "M9 5l7 7-7 7",
} as const;

export type IconName = keyof typeof PATHS;

export function Icon({ name, size = 20 }: { name: IconName; size?: number }) {
  return (
    <svg
      class="icon"
      width={size}
      height={size}
      viewBox="0 0 24 24"
      aria-hidden="true"
      focusable="false"
    >
      <path d={PATHS[name]} />
    </svg>
  );
}
