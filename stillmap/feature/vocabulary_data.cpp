// SPDX-License-Identifier: Apache-2.0
/// Embeds vocabulary.bin into the library (made by `python3 -m lab vocabulary`). The assembler
/// does it, since a table of numbers in the source would take a minute to compile.
__asm__(
    ".section .rodata\n"
    ".balign 16\n"
    ".global stillmap_vocabulary_begin\n"
    ".hidden stillmap_vocabulary_begin\n"
    "stillmap_vocabulary_begin:\n"
    ".incbin \"" STILLMAP_VOCABULARY_FILE
    "\"\n"
    ".global stillmap_vocabulary_end\n"
    ".hidden stillmap_vocabulary_end\n"
    "stillmap_vocabulary_end:\n"
    ".byte 0\n"
    ".previous\n");
