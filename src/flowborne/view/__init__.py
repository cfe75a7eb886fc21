"""Pictures, films and plots of run folders; never touches a live solver.

Called, it shows a run in a browser: see `browser.open_page.view`.
"""

from flowborne.base.called import calls

calls(__name__, "flowborne.view.browser.open_page", "view")
