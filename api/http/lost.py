"""The page for a person whose browser asked for something that does not exist; programs get a problem document."""

from html import escape
from string import Template

from fastapi import Request
from fastapi.responses import HTMLResponse

from gaplab.api.http.security_headers import page
from gaplab.schemas.problems import Problem

_PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>$title · gaplab</title>
<style>body { font: 1rem/1.5 system-ui, sans-serif; max-width: 40rem; margin: 4rem auto; padding: 0 1rem; }</style>
</head>
<body>
<main>
<h1>$title</h1>
<p>$detail</p>
<p><a href="$root/">To the experiments</a> · <a href="$root/docs">The addresses of the API</a></p>
</main>
</body>
</html>
""")


def asks_for_a_page(request: Request) -> bool:
    """Return whether a browser wants to show the answer as a page."""
    return request.method == "GET" and "text/html" in request.headers.get("accept", "")


def lost(request: Request, problem: Problem) -> HTMLResponse:
    """Return the problem as a page with ways out of it."""
    root = escape(request.scope.get("root_path", ""))
    html = _PAGE.substitute(title=escape(problem.title), detail=escape(problem.detail), root=root)
    answer = page(html)
    answer.status_code = problem.status
    return answer
