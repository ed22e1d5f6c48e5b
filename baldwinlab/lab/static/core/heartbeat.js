/** Requests that notice a server that does not answer, for example because it is suspended. */

import { getJSON, isServerless, showConnection } from "./common.js";

// Milliseconds between two requests, and until the server is reported.
const INTERVAL = 2000;
const PATIENCE = 3000;
const SILENT = "The lab has not answered for 3 seconds. The page continues when it answers.";

/** Request an answer again and again, and show a banner while there is none. */
export async function watchServer() {
  while (!isServerless()) {
    // A hidden page shows no banner.
    if (!document.hidden) await requestAnswer();
    await new Promise((resolve) => setTimeout(resolve, INTERVAL));
  }
}

/** Wait for an answer. The banner disappears with the first answer to any request. */
async function requestAnswer() {
  const timer = setTimeout(() => showConnection(false, SILENT), PATIENCE);
  try {
    await getJSON("api/engine");
  } catch {
    // The banner shows errors of access. Other errors are answers.
  } finally {
    clearTimeout(timer);
  }
}
