// What is asked again and again while something goes on: never two at a time, and a while apart.

/**
 * A task that may be wished for at any moment. It runs at once, or a while after its last run has ended; what is wished for meanwhile
 * is done once. The task tells its own failures.
 */
export function paced(task: () => Promise<void>, restMs: number): () => void {
  let [running, wished] = [false, false];
  const run = async (): Promise<void> => {
    running = true;
    while (wished) {
      wished = false;
      await task();
      await new Promise((rested) => setTimeout(rested, restMs));
    }
    running = false;
  };
  return () => {
    wished = true;
    if (!running) void run();
  };
}
