# SPDX-License-Identifier: Apache-2.0
"""The laboratory of Stillmap: runs the program over sequences and tabulates its results. See lab/README.md."""
