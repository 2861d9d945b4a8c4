//! What the pages of reports share.

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;color:#1b1f24;background:#fff;max-width:64rem;\
margin:2rem auto;padding:0 1rem}h1{font-size:1.5rem;margin-bottom:.2rem}h2{font-size:1.1rem;margin-top:2.2rem}\
p{color:#4a525a}table{border-collapse:collapse;width:100%;font-size:.86em;font-variant-numeric:tabular-nums}\
th,td{padding:.25rem .45rem;text-align:right;border-bottom:1px solid #e3e6e9}th{font-weight:600;color:#4a525a}\
th:first-child,td:first-child{text-align:left}.wrong{color:#b3261e;font-weight:600}.none{color:#8a929a}\
svg{display:block;width:100%;height:auto;margin:.4rem 0 1rem}svg text{font:12px system-ui,sans-serif;fill:#1b1f24}\
svg .faint{fill:#6a727a}svg .name{paint-order:stroke;stroke:#fff;stroke-width:4px;stroke-linejoin:round}figure{margin:0}figcaption{font-weight:600}\
td,th{white-space:nowrap}.strip img{width:236px;height:auto}.strip{display:flex;flex-wrap:wrap;gap:.6rem;margin:.6rem 0 1rem}.strip figcaption{font-weight:400;font-size:.85em;\
color:#4a525a}.front{background:#eef4ea}pre{background:#f4f6f8;padding:.6rem .8rem;overflow-x:auto;white-space:pre-wrap}";

/// A page with everything in it: it asks the network for nothing.
pub(super) fn page(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title>\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<style>{STYLE}</style></head>\n\
         <body>\n{body}</body></html>\n",
        escaped(title)
    )
}

/// Text that cannot break the page.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_the_page() {
        assert_eq!(escaped("a<b>&\"c\""), "a&lt;b&gt;&amp;&quot;c&quot;");
    }
}
