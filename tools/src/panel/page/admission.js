// Whether this page's token is one of the program: a browser does not tell why a connection was refused.

import { token } from "./connection.js";

/** Calls this if the program answers, and does not know the token. */
export async function whenUnknown(tell) {
  try {
    const answer = await fetch(`/known?token=${encodeURIComponent(token)}`, { signal: AbortSignal.timeout(5000) });
    if (answer.status === 403) tell();
  } catch {
    // It does not answer, as the page says already.
  }
}
