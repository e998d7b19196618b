/** What the camera sees; asked for only while somebody can see it. */

import { useEffect, useRef, useState } from "preact/hooks";
import { cameraPicture } from "../api/client";
import { sentenceOf } from "../state/notice";

/** Between two pictures, milliseconds. */
const PAUSE = 250;
const PAUSE_AFTER_FAILURE = 2_000;

export function CameraPicture() {
  const box = useRef<HTMLElement>(null);
  const [address, setAddress] = useState<string | null>(null);
  const [why, setWhy] = useState("No picture yet.");
  useEffect(() => {
    let ended = false;
    let visible = true;
    let timer: ReturnType<typeof setTimeout>;
    let shown: string | null = null;
    const watcher = new IntersectionObserver(([entry]) => {
      visible = entry.isIntersecting;
    });
    if (box.current) watcher.observe(box.current);
    const show = (next: string | null) => {
      if (shown) URL.revokeObjectURL(shown);
      shown = next;
      setAddress(next);
    };
    const turn = async () => {
      let pause = PAUSE;
      if (visible && !document.hidden) {
        try {
          const picture = await cameraPicture();
          if (!ended) show(URL.createObjectURL(picture));
        } catch (error) {
          if (!ended) {
            show(null);
            setWhy(sentenceOf(error));
          }
          pause = PAUSE_AFTER_FAILURE;
        }
      }
      if (!ended) timer = setTimeout(turn, pause);
    };
    void turn();
    return () => {
      ended = true;
      clearTimeout(timer);
      watcher.disconnect();
      if (shown) URL.revokeObjectURL(shown);
    };
  }, []);
  return (
    <figure class="camera" ref={box}>
      {address ? (
        <img src={address} alt="What the robot's camera sees" />
      ) : (
        <p class="quiet">{why}</p>
      )}
    </figure>
  );
}
