"""Draws the page of the committed validation report anew from its data: `make validation-page`."""

from __future__ import annotations

from failing import REPORT
from flowborne.validation.page import write_page

if __name__ == "__main__":
    write_page(REPORT)
