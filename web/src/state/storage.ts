/** What the browser keeps. A browser that keeps nothing (private windows) is no error. */

export function storedText(key: string): string | null {
  try {
    return window.localStorage.getItem(key);
  } catch {
    return null;
  }
}

export function storeText(key: string, text: string | null): boolean {
  try {
    if (text === null) window.localStorage.removeItem(key);
    else window.localStorage.setItem(key, text);
    return true;
  } catch {
    return false;
  }
}

/** The names of what is kept that begin so, in order. */
export function storedKeys(prefix: string): string[] {
  try {
    return Object.keys(window.localStorage)
      .filter((key) => key.startsWith(prefix))
      .sort();
  } catch {
    return [];
  }
}

export function stored<T>(key: string): T | null {
  try {
    return JSON.parse(storedText(key) ?? "null") as T | null;
  } catch {
    return null;
  }
}
