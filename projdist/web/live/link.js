// The way to whoever answers: a socket to the server, or whatever carries messages and blocks in a notebook.

import { readBlock } from "./frames.js";

const AGAIN = 1000; // milliseconds

// Opens a socket and hands over what comes back. `states` hears of "open", "closed", "full" and "refused".
export class Socket {
  constructor(url, token, states) {
    Object.assign(this, { url, token, states });
    this.open();
  }

  open() {
    this.socket = new WebSocket(this.url);
    this.socket.binaryType = "arraybuffer";
    // As Python writes it, for the server compares bytes.
    this.socket.onopen = () => this.socket.send(`{"token": ${JSON.stringify(this.token)}}`);
    this.socket.onmessage = ({ data }) => {
      if (typeof data === "string") this.states("open", JSON.parse(data));
      else this.received(data);
    };
    this.socket.onclose = ({ code }) => {
      if (code === 4401) return this.states("refused");
      this.states(code === 4429 ? "full" : "closed");
      setTimeout(() => this.open(), AGAIN);
    };
  }

  send(text, file) {
    if (this.socket.readyState !== WebSocket.OPEN) return;
    if (!file) return this.socket.send(text);
    const bytes = new TextEncoder().encode(text);
    this.socket.send(new Blob([new Uint32Array([bytes.length]), bytes, file]));
  }
}

// Requests and their replies. Of each kind and map only the newest counts; with `flow` one is on its way at a time.
export class Link {
  constructor(carrier) {
    this.carrier = carrier;
    this.next = 1;
    this.open = new Map();
    carrier.received = (buffer) => this.receive(buffer);
  }

  ask(kind, slot, content, answer, file) {
    const key = `${kind} ${slot}`, id = this.next++;
    this.open.set(key, { id, answer, asked: performance.now() });
    this.carrier.send(JSON.stringify({ id, kind, slot, ...content }), file);
  }

  stop(kind, slot) {
    this.open.delete(`${kind} ${slot}`);
    this.carrier.send(JSON.stringify({ id: this.next++, kind: "stop", slot, options: { what: kind } }));
  }

  forget() {
    this.open.clear();
  }

  receive(buffer) {
    const block = readBlock(buffer), key = `${block.kind} ${block.slot}`, waiting = this.open.get(key);
    if (!waiting || waiting.id !== block.id) return;
    if (!block.progress) this.open.delete(key);
    waiting.answer(block, performance.now() - waiting.asked);
  }
}
