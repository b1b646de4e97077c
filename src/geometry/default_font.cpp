#include "geometry/default_font.h"

// The font file as it is.
asm(R"(.section .rodata
.global pilesim_default_font
.global pilesim_default_font_end
.balign 16
pilesim_default_font:
.incbin ")" PILESIM_DEFAULT_FONT R"("
pilesim_default_font_end:
.previous
)");
extern "C" const char pilesim_default_font[], pilesim_default_font_end[];

namespace pilesim {

std::string_view default_font() { return {pilesim_default_font, pilesim_default_font_end}; }

}  // namespace pilesim
