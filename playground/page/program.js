// The program in its worker, one request after the other.

class Program {
  // `source` has the `module` of compiled WebAssembly or the `address` of a server.
  constructor(source) {
    this.source = source;
    this.start();
  }

  start() {
    const text = document.getElementById("worker").textContent;
    const place = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
    this.worker = new Worker(place);
    URL.revokeObjectURL(place);
    this.waiting = new Map();
    this.count = 0;
    this.worker.onmessage = ({ data }) => {
      const { resolve } = this.waiting.get(data.id);
      this.waiting.delete(data.id);
      resolve(data.answer);
    };
    this.worker.onerror = (event) => {
      event.preventDefault();
      this.end("the worker stopped");
    };
    this.worker.postMessage(this.source);
  }

  // True while an answer is due.
  get isBusy() {
    return this.waiting.size > 0;
  }

  ask(request) {
    const id = this.count;
    this.count += 1;
    return new Promise((resolve) => {
      this.waiting.set(id, { resolve });
      this.worker.postMessage({ id, request });
    });
  }

  // Ends whatever it does and starts anew, without a scene.
  restart() {
    this.end("ended");
    this.start();
  }

  end(why) {
    this.worker.terminate();
    const waiting = [...this.waiting.values()];
    this.waiting = new Map();
    for (const { resolve } of waiting) resolve({ trap: why });
  }
}
