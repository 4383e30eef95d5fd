// Canvases of what stays on a map while its colours change.

export class Sheets {
  constructor() {
    this.kept = new Map();
    this.of = [];
  }

  // Forgets all of them where anything that they were drawn of is another.
  suit(width, height, ...of) {
    const known = [width, height, ...of];
    if (known.length === this.of.length && known.every((value, k) => value === this.of[k])) return;
    this.kept.clear();
    [this.width, this.height, this.of] = [width, height, known];
  }

  // The canvas of a name; `work` draws on it when it is asked for first.
  get(name, work) {
    if (!this.kept.has(name)) {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [this.width, this.height];
      work(canvas.getContext("2d"));
      this.kept.set(name, canvas);
    }
    return this.kept.get(name);
  }
}
