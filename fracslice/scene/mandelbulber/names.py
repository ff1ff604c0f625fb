"""Names of Mandelbulber's formulas by the numbers in its files, for messages."""

from __future__ import annotations

_TEXT = """
1 fastMandelbulb; 2 mandelbulb; 3 mandelbulbPower2; 4 hypercomplex; 5 quaternion; 6 minusFastTrig
7 mengerSponge; 8 mandelbox; 9 mandelboxFast; 10 kaleidoscopicIfs; 11 xenodreambuie; 12 hybrid
13 mandelbulb2; 14 mandelbulb3; 15 mandelbulb4; 16 boxFoldBulbPow2; 17 mandelboxSmooth
18 mandelboxVaryScale4d; 19 aexion; 20 benesi; 21 bristorbrot; 22 invertX; 23 invertY; 24 invertZ
25 invertR; 26 sphericalFold; 27 powXYZ; 28 scaleX; 29 scaleY; 30 scaleZ; 31 offsetX; 32 offsetY; 33 offsetZ
34 angleMultiplyX; 35 angleMultiplyY; 36 angleMultiplyZ; 37 generalizedFoldBox; 38 oclCustom; 39 ides
40 ides2; 41 buffalo; 48 quickDudley; 49 lkmitch; 50 makin3d2; 51 msltoeSym2Mod; 56 transfPlatonicSolid
59 foldBoxMod1; 60 aboxModKali; 61 mengerMod1; 62 quaternion3d; 63 aexionOctopusMod; 64 aboxMod1
65 mandelbulbMulti; 66 benesiPineTree; 67 benesiT1PineTree; 68 msltoeSym3Mod; 69 msltoeSym4Mod
70 eiffieMsltoe; 71 riemannSphereMsltoeV1; 72 riemannSphereMsltoe; 73 amazingSurf; 74 kalisets1; 75 aboxMod2
76 aboxVSIcen1; 77 amazingSurfMod1; 78 mandelbulbVaryPowerV1; 79 quaternion4d; 80 msltoeSym3Mod2
81 msltoeSym3Mod3; 82 msltoeDonut; 83 iqBulb; 84 quickDudleyMod; 85 riemannBulbMsltoeMod2; 86 msltoeToroidal
87 aboxModKaliEiffie; 88 collatz; 89 collatzMod; 90 mengerPwr2Poly; 91 mandelboxMenger; 92 mandelbulbKali
93 mandelbulbKaliMulti; 94 mandelbulbBermarte; 95 mengerMiddleMod; 96 msltoeToroidalMulti
97 amazingSurfMulti; 98 mengerCrossKIFS; 99 mengerPrismShape; 100 benesiMagTransforms
101 pseudoKleinianStdDE; 102 bristorbrot4d; 103 pseudoKleinian; 104 pseudoKleinianMod1
105 benesiPwr2Mandelbulb; 106 mengerCrossMod1; 107 mengerPrismShape2; 108 mixPinski4d; 109 sierpinski4d
110 sierpinski3d; 111 menger4d; 112 menger4dMod1; 113 mengerSmooth; 114 mengerSmoothMod1; 115 mengerOcto
116 abox4d; 117 pseudoKleinianMod2; 118 mandelbulbMulti2; 119 aboxMod11; 120 mandelbulbQuat
121 mandelbulbJuliabulb; 122 josKleinian; 123 aboxMod12; 124 quaternionCubic4d; 125 boxFoldBulbPow2V2
126 boxFoldBulbPow2V3; 127 aboxMod13; 128 boxFoldQuat; 129 coastalbrot; 130 modulusMengerSponge
131 modulusMandelbulb; 132 amazingSurfMod2; 133 mandelboxVariable; 134 boxFold4dBulbPow2; 135 aboxModKaliV2
136 aboxModKaliV3; 137 mandelbulbAbsPower2; 138 mandelbulbPow2V2; 139 riemannSphereMsltoeV2; 140 aboxSurfBox
141 boxFoldBulbMenger; 142 vicsek; 143 josKleinianV2; 144 mandelbulbAtan2Power2; 145 bristorbrot2
146 mandeltorus; 147 amazingSurfMod3; 148 mandelbulbPower1234; 149 mengerPolyFold; 150 ifsXY
152 scatorPower2Imaginary; 156 scatorPower2Real; 160 scatorTest; 173 scatorPower2; 174 scatorPower2StdR
180 riemannSphereHoboldPow4; 181 riemannSphereHoboldPow8; 182 mandelbulbKosalos; 183 mandelbulbKosalosV2
184 riemannSphereHoboldMulti; 185 mandelbulbLambda; 186 amazingSurfMod4; 187 aboxSphere4d; 188 aboxTetra4d
189 mengerV2; 190 mengerV3; 191 koch; 192 kochV2; 193 kochV3; 194 foldCutCube; 195 knotV1; 196 knotV2
197 pseudoKleinianMod3; 198 mandalayBoxV1; 199 mandalayBoxV2; 200 mandalayKIFS; 201 sierpinski3dV2
202 sierpinski3dV3; 203 mengerChebyshev; 204 riemannSphereMsltoeM3d; 205 octahedron; 206 aboxMod14
207 menger3; 208 mandelcup; 209 spheretree; 210 spheretreeV2; 211 sierpinski3dV4; 212 mandeltorusV2
213 aexion4dV2; 214 menger4dMod2; 215 mandelbulbPlusZ; 216 mandelbulbAbs; 217 pseudoKleinianMod4
218 msltoeSym3Mod4; 219 msltoeSym3Mod5; 220 msltoeSym3Mod6; 221 amazingSurfKlein; 222 aboxKlein
223 aboxTetra; 224 amazingSurfKleinV2; 225 josKleinianV3; 226 aboxMod15; 227 kochV4; 228 ifsGen
229 mandelnest; 230 josKleinianV4; 231 pseudoKleinianMod5; 232 mandelnestV2; 233 amazingSurfM3d
234 pseudoKleinian4d; 235 hypercomplexV2; 236 mandelbar; 237 boxFoldBulbV4; 238 mandelbulbQuadrat
239 amazingIfs; 240 mandelbulbPow2V3; 241 aboxSmooth; 242 mengerV4; 243 menger3M3d; 244 msltoeSym4Mod1
245 mengerV5; 246 mandelbulbSinCos; 247 mandelnest4d; 248 mandelbulbIqPow8; 249 mandelbulbIqV2
250 newtonPow3; 251 mandelbulbTails; 252 mandelbulbTailsV2; 253 pseudoKleinianMod6; 254 mandelbulbSinCosV2
255 mandelbulbSinCosV3; 256 mandelbulbSinCosV4; 257 mengerSmoothChebyshev; 258 mengerPyramid
259 mandelnestFull; 260 mandelbarV2; 261 msltoeToroidalV2; 262 mandelbulbPow2V1; 263 mengerV6
264 xenodreambuieV2; 265 xenodreambuieV3; 266 mandelbulbPupuku; 267 sphereCluster; 268 sphereClusterV2
269 aboxDonut4dV2; 270 aboxDonut4d; 271 mengerV7; 272 spheretreeV5; 273 tinkerTowers; 274 spheretreeV4
275 sphereClusterV3; 276 pseudoKleinianMod7; 277 eiffieCar; 278 kochV5; 279 kochIfs; 280 msltoeToroidalV3
281 mandelbulbPow2V4; 282 mandelbarV3; 283 pseudoKleinianTrig; 284 pseudoKleinianTrigV2
285 pseudoKleinianTrigV3; 286 aboxMb3d1; 287 dualPowerMandelbox; 288 chebyshevBulb; 600 dIFSBoxDiagonalV1
601 dIFSBoxV1; 602 dIFSBoxDiagonalV3; 603 dIFSCylinder; 604 dIFSSphere; 605 dIFSEllipsoid; 606 dIFSTorus
607 dIFSMenger; 608 dIFSHextgrid2; 609 dIFSPrism; 610 dIFSMsltoeDonut; 611 dIFSMultiV1; 612 dIFSAmazingIfs
613 dIFSGreekIfs; 800 mandelbulbEye; 1001 transfAddConstant; 1002 transfRotation; 1003 transfScale
1004 transfScale3d; 1005 transfBoxOffset; 1006 transfSphericalOffset; 1007 transfAddCpixel
1008 transfAddCpixelAxisSwap; 1009 transfBenesiT1; 1010 transfBenesiT1Mod; 1011 transfBenesiT2
1012 transfBenesiT3; 1013 transfBenesiT4; 1014 transfBenesiT5b; 1015 transfBenesiMagForward
1016 transfBenesiMagBackward; 1017 transfBenesiCubeSphere; 1018 transfBenesiSphereCube
1019 transfAddCpixelSymmetrical; 1020 transfBoxFold; 1021 transfSphericalFold; 1022 transfZvectorAxisSwap
1023 transfAbsAddConstant; 1024 transfNegAbsAddConstant; 1025 transfAbsAddTgladFold
1026 transfMultipleAngle; 1027 transfRPower; 1028 transfIterationWeight; 1029 transfAbsAddMulti
1030 transfSphericalPwrFold; 1031 transfAddCpixelVaryV1; 1032 transfScaleVaryV1
1033 transfAddConstantVaryV1; 1034 transfBoxFoldXYZ; 1035 transfAddCpixelCxCyAxisSwap
1036 transfRotationVaryV1; 1037 transfLinCombineCXYZ; 1038 transfSphericalInvC; 1039 transfAddConstant4d
1040 transfBoxFold4d; 1041 transfIterationWeight4d; 1042 transfSphericalFold4d; 1043 transfScale4d
1044 transfAbsAddConstant4d; 1045 transfAbsAddTgladFold4d; 1046 transfSurfFoldMulti
1047 transfPwr2Polynomial; 1048 transfRotationFoldingPlane; 1049 transfSphericalFoldAbox
1050 transfSphericalFoldVaryV1; 1051 transfQuaternionFold; 1052 transfMengerFold; 1053 transfInvCylindrical
1054 transfRpow3; 1055 transfSphericalInv; 1056 transfFoldingTetra3d; 1057 transfBoxFoldVaryV1
1058 transfSurfBoxFold; 1059 transfOctoFold; 1060 transfScaleVaryVCL; 1061 transfSphericalFoldVaryVCL
1062 transfAddExp2Z; 1063 transfReciprocal3; 1064 transfRotationFolding; 1065 transfAbsAddConditional
1066 transfReciprocal4d; 1067 transfAbsAddConditional4d; 1068 transfSphericalOffsetVCL
1069 transfRotation4d; 1070 transfParabFold; 1071 transfScaleVaryV212; 1072 transfSphericalFoldCHS
1073 transfSphericalFoldParab; 1074 transfScaleVaryMulti; 1075 transfBoxFold4dTglad
1076 transfSphericalFoldCuboid; 1077 transfSphericalFoldXYZBias; 1078 transfAddCpixelRotated
1079 transfAddConstantMod1; 1080 transfPolyFoldSymXY; 1081 transfPolyFoldSymMulti; 1082 transfSinOrCos
1083 transfSinAndCos; 1084 transfSinAndCosMax; 1085 transfBlockify; 1086 transfAddCpixelScator
1087 transfAddCpixelSinOrCos; 1088 transfSurfBoxFoldV2; 1089 transfBoxWrap4d; 1090 transfSphericalInvV2
1091 transfRotationIterControls; 1092 transfClamp4d; 1093 transfAbsAddMulti4d; 1094 transfRotateAboutVec3
1095 transfOffsetSCurve4d; 1096 transfGnarl; 1097 transfBoxTiling4d; 1098 transfDiagonalFold
1099 transfPolyFoldAtan; 1100 transfPolyFoldAtan2; 1101 transfAbsAddConditional2; 1102 transfAddConstantMod2
1103 transfAddConstantRotV1; 1104 transfSurfBoxFoldV24d; 1105 transfScaleOffset; 1106 transfScaleOffsetV2
1107 transfDEControls; 1108 transfMandalayFoldV1; 1109 transfMandalayFoldV2; 1110 transfSinAdd
1111 transfSphericalFoldV1; 1112 transfRotationChebyshev; 1113 transfDELinearCube
1114 transfSphericalFoldV2; 1115 transfBoxTilingV2; 1116 transfStepXY; 1117 transfAbsRecFoldXY
1118 transfAddNorm; 1119 transfMandalayFold4d; 1120 transfSmooth; 1121 transfSmoothV2; 1122 transfInitial4d
1123 transfAddCpixel4d; 1124 transfSphericalFold4dV2; 1125 transfBlockifyV2; 1126 transfPolyFoldAtan2Iter
1127 transfSinTan; 1128 transfAddConstantMod3; 1129 transfRotationM3d; 1130 transfSphericalInvPnorm
1131 transfSphericalFoldPnorm; 1132 transfSphericalCoordInvs; 1133 transfAddScaleRotate
1134 transfQuadraticFold4d; 1135 transfAddCpixelInvert; 1136 transfAddCpixelSphereFold
1137 transfAddCpixelTile; 1138 transfSincos; 1139 transfSphericalFoldV3; 1140 transfPolyXYFoldV1
1141 transfSphericalFoldSmooth; 1142 transfCayley2V1; 1143 transfSincosV2; 1144 transfLowResMode
1145 transfMengerFoldV2; 1146 transfAddSphericalInvert; 1147 transfSupershape; 1148 transfSinYM3d
1149 transfSincosHelix; 1150 transfBoxTilingV3; 1151 transfDotFold; 1152 transfAbsAddConstantV2
1153 transfSphericalInvV3; 1154 transfJuliabox; 1155 transfSphericalInvV4; 1156 transfJuliaboxV2
1157 transfBoxFold4dInfy; 1158 transfAbsSym3; 1600 transfDIFSBox; 1601 transfDIFSCylinder
1602 transfDIFSEllipsoid; 1603 transfDIFSHextgrid2; 1604 transfDIFSSphere; 1605 transfDIFSTorus
1606 transfDIFSPrism; 1607 transfDIFSBoxV2; 1608 transfDIFSCylinderV2; 1609 transfDIFSBoxV3
1610 transfDIFSTorusV2; 1611 transfDIFSTorusV3; 1612 transfDIFSPrismV2; 1613 transfDIFSGrid
1614 transfDIFSGridV2; 1615 transfDIFSTorusGrid; 1616 transfDIFSHexprism; 1617 transfDIFSPolyhedra
1618 transfDIFSPolyhedraV2; 1619 transfDIFSGearV1; 1620 transfDIFSGridV3; 1621 transfDIFSClipPlane
1622 transfDIFSDiamond; 1623 transfDIFSSpring; 1624 transfDIFSAmazingIfs; 1625 transfDIFSHexprismV2
1626 transfDIFSTriGrid; 1627 transfDIFSSphereGrid; 1628 transfDIFSSphereGridV2; 1629 transfDIFSSphereGridV3
1630 transfDIFSTorusTwist; 1631 transfDIFSHeart; 1632 transfDIFSHelix; 1633 transfDIFSBoxFrame
1634 transfDIFSPiriform; 1635 transfDIFSClipCustom; 1636 transfDIFSHelixV2; 1637 transfDIFSCayley2
1638 transfDIFSHelixMenger; 1639 transfDIFSChessboard; 1640 transfDIFSTorusMenger; 1641 transfDIFSSupershape
1642 transfDIFSOctahedron; 1643 transfDIFSOctahedronV2; 1644 transfDIFSSupershapeV2; 1645 transfDIFSTube
1646 transfDIFSTorusV4; 2000 transfHybridColor; 2001 transfHybridColor2; 2002 transfDIFSHybridColor
2100 testing; 2101 testing4d; 2103 testingLog; 2104 testingTransform; 2105 testingTransform2; 10000 custom
"""

NAMES = {
    int(number): name
    for line in _TEXT.split("\n")
    for number, name in (item.split() for item in line.split(";") if item.strip())
}
"""Names by number."""
