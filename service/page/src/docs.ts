// The HTTP reference: Swagger UI, kept packed beside this page, over the service's own OpenAPI document.
import "swagger-ui-dist/swagger-ui.css";
import { at } from "./api/here";

declare global {
  interface Window {
    SwaggerUIBundle?: (options: Record<string, unknown>) => unknown;
  }
}

const script = document.createElement("script");
script.src = at("/page/swagger-ui-bundle.js.gz");
script.addEventListener("load", () => {
  window.SwaggerUIBundle?.({ url: at("/openapi.json"), dom_id: "#reference", deepLinking: true });
});
script.addEventListener("error", () => {
  document.getElementById("reference")?.append("The reference did not load; is the service still running?");
});
document.body.append(script);
