// Asking the service. What it refuses, and what does not arrive, becomes an Error whose message is one sentence.

const OVER = ["succeeded", "failed", "cancelled", "interrupted"];
const WAIT_S = 1;

export async function ask(path, options = {}) {
  let answer;
  try {
    answer = await fetch(path, options);
  } catch {
    throw new Error("The service does not answer; is it still running?");
  }
  if (answer.status === 204) return { body: null, headers: answer.headers };
  let body;
  try {
    body = await answer.json();
  } catch {
    throw new Error(`The service answered ${answer.status} with something that cannot be read.`);
  }
  if (!answer.ok) throw new Error(body.detail || `The service answered ${answer.status}.`);
  return { body, headers: answer.headers };
}

// A calculation from asking to its result; told is called, and waited for, with the job as it goes on.
export async function calculate(path, question, told) {
  const { body } = await ask(path, {
    method: "POST",
    headers: { "Content-Type": "application/json", Prefer: `wait=${WAIT_S}` },
    body: JSON.stringify(question),
  });
  let job = body;
  while (!OVER.includes(job.status)) {
    await told(job);
    await new Promise((resume) => setTimeout(resume, 300));
    job = (await ask(job.links.self)).body;
  }
  if (job.status === "cancelled") return null;
  if (job.status !== "succeeded") {
    throw new Error(job.problem?.detail || `The calculation is ${job.status}; ask again.`);
  }
  return job;
}
